"""The words of the points page: what to feel for, how sure a suggestion is, what is still open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fastapi import Request

from lubdub.results import BONE_LANDMARKS, LANDMARK_NAMES, Examination, LandmarkName
from lubdub.web.pages_look import gettext_of
from lubdub.web.pages_marks import Marks


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
            _(
                "Slide a finger down the throat into the soft hollow between the collarbones. "
                "Tap the hard edge just below it."
            ),
        ),
        "xiphisternum": PointText(
            _("lower end of the breastbone"),
            _("Feel the lower end of the breastbone"),
            _(
                "Slide a finger down the middle of the breastbone until the bone stops and the soft belly begins. "
                "Tap the last hard spot."
            ),
        ),
        "navel": PointText(_("belly button"), _("Find the belly button"), _("Tap its middle on the picture.")),
        "nipple_left": PointText(
            _("patient's left nipple"),
            _("Find the patient's left nipple"),
            _("It is on the side of the left hand: the right side of the picture. Tap its middle."),
        ),
        "nipple_right": PointText(
            _("patient's right nipple"),
            _("Find the patient's right nipple"),
            _("It is on the side of the right hand: the left side of the picture. Tap its middle."),
        ),
    }


class PointsWords:
    """What the page says about one case's points now."""

    def __init__(
        self, request: Request, examination: Examination, marks: Marks, asked: tuple[LandmarkName, ...]
    ) -> None:
        """Over what was suggested and what was said. asked: the points asked of this patient."""
        self._ = gettext_of(request)
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
        return {**self._point(name), "heading": text.heading, "how": text.how, "state_words": self._state_words(name)}

    def summary(self) -> str:
        """What the answer will rest on."""
        _ = self._
        if all(name in self._marks.placed for name in BONE_LANDMARKS):
            return _("Both ends of the breastbone are marked. That makes the places trustworthy.")
        return _("Without both ends of the breastbone, felt with a finger, the places will be less sure.")

    def _point(self, name: LandmarkName) -> dict[str, Any]:
        state = self._state(name)
        _ = self._
        short = {
            "marked": _("marked"),
            "stuck": _("by sticker"),
            "kept": _("suggestion kept"),
            "skipped": _("skipped"),
            "optional": _("not needed"),
            "suggested": _("suggested"),
            "open": _("to do"),
        }
        return {
            "name": name,
            "number": LANDMARK_NAMES.index(name) + 1,
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

    def _how_near(self, sigma_mm: float) -> str | None:
        """One standard deviation in words, a little on the careful side; None when it says nothing."""
        _ = self._
        steps = ((7.0, _("half a centimetre")), (14.0, _("1 cm")), (24.0, _("2 cm")))
        return next((words for limit, words in steps if sigma_mm <= limit), None)
