"""The words of the points page: what to feel for, how sure a suggestion is, what is still open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from fastapi import Request

from lubdub.marking import Oddity, lies_clear
from lubdub.results import BONE_LANDMARKS, LANDMARK_NAMES, Examination, LandmarkName
from lubdub.web.pages.common import is_unclear
from lubdub.web.pages.look import gettext_of
from lubdub.web.pages.marks import Marks
from lubdub.web.pages.points_odd import odd_texts


@dataclass(frozen=True)
class PointText:
    """What a parent reads about one point."""

    title: str
    heading: str
    how: str


def point_texts(_: Callable[[str], str]) -> dict[LandmarkName, PointText]:
    """All five, in the page's language."""
    return {
        "suprasternal_notch": PointText(
            _("top of the breastbone"),
            _("Feel the top of the breastbone"),
            _("Tap the hard upper edge, just below the soft hollow."),
        ),
        "xiphisternum": PointText(
            _("lower end of the breastbone"),
            _("Feel the lower end of the breastbone"),
            _("Tap the last hard spot, where the ribs of both sides meet."),
        ),
        "navel": PointText(_("belly button"), _("Find the belly button"), _("Tap its middle on the picture.")),
        "nipple_left": PointText(
            _("patient's left nipple"),
            _("Find the patient's left nipple"),
            _("It is on the side of the person's own left hand. Tap its middle."),
        ),
        "nipple_right": PointText(
            _("patient's right nipple"),
            _("Find the patient's right nipple"),
            _("It is on the side of the person's own right hand. Tap its middle."),
        ),
    }


class PointsWords:
    """What the page says about one case's points now."""

    def __init__(
        self,
        request: Request,
        examination: Examination,
        marks: Marks,
        asked: tuple[LandmarkName, ...],
        oddities: tuple[Oddity, ...] = (),
    ) -> None:
        """Over what was suggested and what was said. asked: the points asked of this patient."""
        self._ = gettext_of(request)
        self.is_unclear = is_unclear(examination)
        self._oddities = oddities
        self._texts = point_texts(self._)
        self._suggested = examination.suggested
        self._marks = marks
        self._asked = asked

    def all_points(self) -> list[dict[str, Any]]:
        """The list of five with their states."""
        return [self._point(name) for name in LANDMARK_NAMES]

    def current(self) -> dict[str, Any] | None:
        """The point the next tap sets, None when all are answered."""
        name = next((one for one in LANDMARK_NAMES if one == self._marks.target), None)
        if name is None:
            return None
        text = self._texts[name]
        return {
            **self._point(name),
            "heading": text.heading,
            "how": text.how,
            "state_words": self._state_words(name),
            "cost": self._cost(name),
            "of": len(self._asked),
        }

    def odd(self) -> list[str]:
        """What is odd about the points placed so far and how to mend it, the gravest first."""
        texts = odd_texts(self._)
        return [texts[oddity.what].format(point=self._texts[oddity.names[0]].title) for oddity in self._oddities]

    def stop(self) -> str | None:
        """Why the places cannot be looked for yet, None when they can."""
        if any(oddity.is_grave for oddity in self._oddities):
            return self.odd()[0]
        if self._lies_unclear():
            return self._(
                "We still cannot tell which way the body lies. "
                "Please mark the top of the breastbone and the belly button."
            )
        return None

    def mend(self) -> dict[str, Any] | None:
        """The point to look at first when the places cannot be looked for yet."""
        if any(oddity.is_grave for oddity in self._oddities):
            return self._point(self._oddities[0].names[0])
        if self._lies_unclear():
            asked: tuple[LandmarkName, ...] = ("suprasternal_notch", "navel")
            return self._point(next(name for name in asked if name not in self._marks.placed))
        return None

    def _lies_unclear(self) -> bool:
        placed = {name: np.zeros(3) for name in LANDMARK_NAMES if name in self._marks.placed}
        return self.is_unclear and not lies_clear(placed)

    def summary(self) -> str:
        """What the answer will rest on."""
        _ = self._
        if self._oddities:
            return _("Look at each point again before you trust the places.")
        if all(name in self._marks.placed for name in BONE_LANDMARKS):
            return _("Both ends of the breastbone are marked. That makes the places trustworthy.")
        if "suprasternal_notch" in self._marks.placed:
            return _("Without the lower end of the breastbone the places are less sure. The result will say so.")
        if "xiphisternum" in self._marks.placed:
            return _("Without the top of the breastbone the places are less sure. The result will say so.")
        return _("Without both ends of the breastbone the places are less sure. The result will say so.")

    def _cost(self, name: LandmarkName) -> str:
        """What it costs to skip the point."""
        _ = self._
        if name in BONE_LANDMARKS and name not in self._suggested:
            return _("Without this point the places are less sure. The result will say so.")
        if name in BONE_LANDMARKS:
            return _("A guess nobody felt does not count: without this point the places are less sure.")
        if self.is_unclear and name == "navel":
            return _("Without it we may not know which way the body lies.")
        return _("Skipping it costs little when both ends of the breastbone are marked.")

    def _point(self, name: LandmarkName) -> dict[str, Any]:
        state = self._state(name)
        _ = self._
        short = {
            "marked": _("marked"),
            "stuck": _("by sticker"),
            "kept": _("suggestion kept"),
            "skipped": _("skipped"),
            "optional": _("not needed"),
            "suggested": self._guess(name),
            "open": _("to do"),
        }
        return {
            "name": name,
            "number": LANDMARK_NAMES.index(name) + 1,
            "is_odd": any(name in oddity.names for oddity in self._oddities),
            "title": self._texts[name].title,
            "state": state,
            "short_state": short[state],
            "is_marked": name in self._marks.placed,
            "is_suggested": name in self._suggested,
            "is_bone": name in BONE_LANDMARKS,
        }

    def _state(self, name: LandmarkName) -> str:
        if name in self._marks.stuck:
            return "stuck"
        if name in self._marks.placed:
            return "marked"
        if name in self._marks.kept:
            return "kept"
        if name in self._marks.skipped:
            return "skipped"
        if name not in self._asked:
            return "optional"
        return "suggested" if name in self._suggested else "open"

    def _state_words(self, name: LandmarkName) -> str:
        _ = self._
        if name in self._marks.stuck:
            return _("Your sticker marks it. Tap only if it is not in the right place.")
        if name in self._marks.placed:
            return _("Marked. Tap again to move it.")
        if name in self._suggested:
            near = self._how_near(self._suggested[name].uncertainty_mm)
            if near is None:
                return _("Our guess is rough. Please tap the place yourself.")
            return _("Our guess is on the picture, to about {distance}. Tap to correct it.").format(distance=near)
        return _("We could not find it. Please tap it on the picture.")

    def _guess(self, name: LandmarkName) -> str:
        near = self._how_near(self._suggested[name].uncertainty_mm) if name in self._suggested else None
        _ = self._
        return _("rough guess") if near is None else _("guess, to {distance}").format(distance=near)

    def _how_near(self, sigma_mm: float) -> str | None:
        """One standard deviation in words, a little on the careful side; None when it says nothing."""
        _ = self._
        steps = ((7.0, _("half a centimetre")), (14.0, _("1 cm")), (24.0, _("2 cm")))
        return next((words for limit, words in steps if sigma_mm <= limit), None)
