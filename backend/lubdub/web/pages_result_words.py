"""The result in words: the same that the picture shows, for everybody."""

from __future__ import annotations

from typing import Any

import numpy as np
from fastapi import Request

from lubdub.cases.values import Case
from lubdub.results import AREA_NAMES, Area, AreaName, Outcome
from lubdub.web.pages_look import gettext_of, place_looks

ASK_FIRST_MM = 30.0
"""The mitral place of a well-marked adult is known to 27 mm; a wider region leaves too much to luck."""


class ResultWords:
    """What to say about one finished case."""

    def __init__(self, request: Request, case: Case, outcome: Outcome) -> None:
        """Over an outcome that has areas."""
        self._ = gettext_of(request)
        self._case = case
        self._outcome = outcome

    def heading(self) -> str:
        """The answer in one line."""
        _ = self._
        return _("Here is where to listen") if self._is_plain else _("Here is where to listen, with care")

    def lead(self) -> str:
        """How far to trust it, and for whom it is."""
        _ = self._
        if self._is_plain:
            sentence = _("The places were found on this very chest. Put the stethoscope on each, one after the other.")
        else:
            sentence = _("The places are less sure than we would like. Read why, and ask your clinician to check them.")
        return f"{sentence} {self.whose()}"

    def whose(self) -> str:
        """Who the result is of, so that it cannot be taken for another's."""
        _ = self._
        return _("For: {age}, case {case}.").format(age=age_words(self._, self._case.age_years), case=self._case.id[:6])

    def places(self) -> list[dict[str, Any]]:
        """The four areas in listening order."""
        looks = {look["key"]: look for look in place_looks()}
        return [
            self._place(name, self._outcome.areas[name], looks[name])
            for name in AREA_NAMES
            if name in self._outcome.areas
        ]

    def posture(self) -> str:
        """How to lie or sit."""
        _ = self._
        if self._case.posture == "sitting":
            return _("Sit up, as in the scan.")
        return _("Lie on the back, as in the scan. Arms a little away from the body.")

    def facts(self) -> list[tuple[str, str]]:
        """Numbers a clinician may ask for."""
        _ = self._
        quality = self._outcome.quality
        measured = []
        if quality is not None:
            measured = [
                (_("Skin fit (root mean square)"), _mm(quality.surface_residual_mm)),
                (_("Landmark fit"), _mm(quality.landmark_residual_mm)),
                (_("Spread between references"), _mm(quality.spread_mm)),
                (_("Chest covered by the scan"), f"{quality.coverage:.0%}"),
            ]
        method = self._outcome.method
        return [
            *measured,
            (_("Most similar reference"), self._outcome.selected or "–"),
            (_("Method"), f"{method.get('name', 'lubdub')} {method.get('version', '')}".strip()),
        ]

    @property
    def _is_plain(self) -> bool:
        return self._outcome.verdict == "show"

    def _place(self, name: AreaName, area: Area, look: dict[str, Any]) -> dict[str, Any]:
        _ = self._
        titles = {
            "aortic": _("Aortic"),
            "pulmonary": _("Pulmonary"),
            "tricuspid": _("Tricuspid"),
            "mitral": _("Mitral"),
        }
        notch = self._notch()
        side = float(area.position[0] - notch[0])
        return {
            **look,
            "title": titles[name],
            "instruction": area.instruction.split(": ", 1)[-1],
            "sureness": self._sureness(area.radius_mm),
            "down_cm": f"{(notch[1] - area.position[1]) / 10:.1f}",
            "side_cm": f"{abs(side) / 10:.1f} {_('left') if side >= 0 else _('right')}",
            "radius_mm": f"{area.radius_mm:.0f}",
        }

    def _notch(self) -> np.ndarray:
        mark = self._outcome.landmarks.get("suprasternal_notch")
        return np.zeros(3) if mark is None else mark.position

    def _sureness(self, radius_mm: float) -> str:
        _ = self._
        if radius_mm > ASK_FIRST_MM:
            return _("Please ask your clinician before using this one.")
        half_cm = max(1, round(radius_mm / 5)) * 5 / 10
        return _("We are sure to about {distance} cm.").format(distance=f"{half_cm:g}")


def age_words(gettext: Any, age_years: float | None) -> str:
    """The age as one says it."""
    if age_years is None:
        return str(gettext("age not said"))
    months = round(age_years * 12)
    if months < 24:
        return str(gettext("{months} months old")).format(months=months)
    return str(gettext("{years} years old")).format(years=months // 12)


def _mm(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f} mm"
