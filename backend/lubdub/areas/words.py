"""Where an area is, said with what a person can see and feel, in any language: one whole sentence for each case."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from gettext import NullTranslations
from typing import Literal

from lubdub.geometry.whereabouts import Whereabouts

FINGER_MM = 18.0
"""The helper's finger: an adult's forefinger is 16 mm (women) to 20 mm (men) broad; three of them are the old measure
for the 5 cm from the notch to the second rib."""
HALF_CM = 5.0

Person = Literal["child", "self", "patient"]
"""Whose left and right is meant: as the page speaks of the person. Programs and clinicians read of the patient."""


@dataclass(frozen=True)
class Language:
    """How a language says things. number: a length in cm as it is written there ("2,5")."""

    gettext: Callable[[str], str]
    ngettext: Callable[[str, str, int], str]
    number: Callable[[float], str]


ENGLISH = Language(NullTranslations().gettext, NullTranslations().ngettext, lambda value: f"{value:g}")


def instruction(where: Whereabouts, language: Language = ENGLISH, person: Person = "patient") -> str:
    """How to find a place from the top of the breastbone, along the skin."""
    side = "middle" if _half_cm(where.left_mm) == 0 else "left" if where.left_mm > 0 else "right"
    return _sentences(language.gettext)[person, side].format(
        down=measure(where.down_mm, language), side=measure(where.left_mm, language)
    )


def measure(mm: float, language: Language = ENGLISH) -> str:
    """A length in centimetres and in finger-widths, both in halves."""
    halves = max(1, round(2 * abs(mm) / FINGER_MM))
    said = language.ngettext(
        "{distance} cm (about {fingers} finger-width)",
        "{distance} cm (about {fingers} finger-widths)",
        math.ceil(halves / 2),
    )
    return said.format(distance=language.number(_half_cm(mm)), fingers=_in_halves(halves, language))


def _in_halves(halves: int, language: Language) -> str:
    """Half as many, as it is written, and read aloud, in this language."""
    if halves == 1:
        return language.gettext("½")
    whole = str(halves // 2)
    return language.gettext("{count}½").format(count=whole) if halves % 2 else whole


def _half_cm(mm: float) -> float:
    """To the nearest half centimetre: what a tape shows and a squirming child allows."""
    return round(abs(mm) / HALF_CM) * HALF_CM / 10


def _sentences(_: Callable[[str], str]) -> dict[tuple[Person, str], str]:
    return {
        ("child", "left"): _(
            "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
            "Go {down} straight down along the skin, then {side} to your child's left."
        ),
        ("child", "right"): _(
            "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
            "Go {down} straight down along the skin, then {side} to your child's right."
        ),
        ("self", "left"): _(
            "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
            "Go {down} straight down along the skin, then {side} to your own left."
        ),
        ("self", "right"): _(
            "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
            "Go {down} straight down along the skin, then {side} to your own right."
        ),
        ("patient", "left"): _(
            "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
            "Go {down} straight down along the skin, then {side} to the patient's left."
        ),
        ("patient", "right"): _(
            "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
            "Go {down} straight down along the skin, then {side} to the patient's right."
        ),
        **dict.fromkeys(
            (("child", "middle"), ("self", "middle"), ("patient", "middle")),
            _(
                "Start at the top of the breastbone, the hard edge just below the dip in the throat. "
                "Go {down} straight down along the skin and stay in the middle."
            ),
        ),
    }
