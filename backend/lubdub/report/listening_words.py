"""Every sentence of the sheet to print, in any language; what belongs to one person comes with its facts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lubdub.results import AreaName


@dataclass(frozen=True)
class PlaceWords:
    """One place: its name, how to find it, how sure it is."""

    name: AreaName
    title: str
    instruction: str
    sureness: str


@dataclass(frozen=True)
class ListeningFacts:
    """What stands on one person's sheet, in words: no name. care: why to ask first, or nothing."""

    whose: str
    made_on: str
    posture: str
    chestpiece_mm: float
    places: tuple[PlaceWords, ...]
    care: str = ""


@dataclass(frozen=True)
class ListeningWords:
    """The sentences that are the same on every sheet. scale: with {scale}; ring: with {diameter}."""

    title: str
    check: str
    card: str
    five_cm: str
    true_size: str
    scaled: str
    left: str
    right: str
    top_of_bone: str
    end_of_bone: str
    ring: str
    flat: str
    not_diagnosis: str

    def all(self) -> str:
        """All of them in one text."""
        return " ".join(vars(self).values())


def listening_words(_: Callable[[str], str]) -> ListeningWords:
    """The sentences in a language."""
    return ListeningWords(
        title=_("Where to listen to the heart"),
        check=_('Print at "Actual size" or "100 %". Check with a ruler or a bank card:'),
        card=_("Long side of a bank card"),
        five_cm=_("5 cm"),
        true_size=_("The chest is drawn in its true size."),
        scaled=_("The chest is too large for this paper: it is drawn at {scale} % of its true size."),
        left=_("patient's left"),
        right=_("patient's right"),
        top_of_bone=_("Top of the breastbone"),
        end_of_bone=_("Lower end of the breastbone"),
        ring=_("Ring: the stethoscope's head, {diameter} mm across."),
        flat=_("Dashed: where the best spot may be. The picture is flat, so measure the distances on the skin."),
        not_diagnosis=_(
            "This sheet is not a diagnosis. It shows where to listen, not whether a heart is healthy. A clinician must "
            "check the places. Do not delay care because of it."
        ),
    )
