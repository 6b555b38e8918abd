"""The result in words: the same that the picture shows, for everybody."""

from __future__ import annotations

from typing import Any

import numpy as np
from babel.dates import format_date
from babel.numbers import format_decimal, format_percent
from fastapi import Request

from lubdub.areas.words import Language, Person, instruction
from lubdub.cases.reviewing import Review
from lubdub.cases.values import Case
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.whereabouts import whereabouts
from lubdub.report.listening_words import ListeningFacts, PlaceWords
from lubdub.results import AREA_NAMES, Area, AreaName, Outcome
from lubdub.views.scene import chestpiece_mm
from lubdub.web.languages import language_of, words_of
from lubdub.web.pages.look import gettext_of, person_of, place_looks

ASK_FIRST_MM = 30.0
"""The mitral place of a well-marked adult is known to 27 mm; a wider region leaves too much to luck."""

DOUBTS = frozenset(
    (
        *("methods_disagree", "breastbone_unusual", "landmarks_unusual", "points_out_of_order", "stickers_swapped"),
        *("age_and_size", "flat_chest", "odd_shape", "two_bodies", "mirrored_file"),
    )
)
"""Codes of the warnings that something is perhaps quite wrong: how sure a place is holds only if it is not."""


class ResultWords:
    """What to say about one finished case."""

    def __init__(self, request: Request, case: Case, outcome: Outcome, review: Review) -> None:
        """Over an outcome that has areas, corrected ones where they are signed. review: empty until then."""
        self._ = gettext_of(request)
        self._case = case
        self._outcome = outcome
        self._review = review
        self._locale = language_of(request)
        self._language = language_in(self._locale)
        spoken: dict[str, Person] = {"child": "child", "self": "self"}
        self._person = spoken.get(person_of(request), "patient")
        self._skin = None if outcome.scan is None else SkinCaster(outcome.scan.display)

    def heading(self) -> str:
        """The answer in one line."""
        _ = self._
        return _("Here is where to listen") if self._is_plain else _("Here is where to listen, with care")

    def lead(self) -> str:
        """How far to trust it."""
        _ = self._
        if self._is_signed:
            return _("A clinician has looked at each of the four places on this very chest.")
        if self._is_plain:
            return _("The places were found on this very chest. Put the stethoscope on each, one after the other.")
        return _("The places are less sure than we would like. Read why, and ask your clinician to check them.")

    def whose(self) -> str:
        """Who the result is of, so that it cannot be taken for another's, nor a sample for anybody's."""
        _ = self._
        age = age_words(self._language, self._case.age_years)
        said = _("For: {age}, case {case}.").format(age=age, case=self._case.id[:6])
        return f"{_('This is a sample.')} {said}" if self._case.person == "sample" else said

    def checked(self) -> str:
        """Who signed, and when; empty before."""
        decision, _ = self._review.decision, self._
        if decision is None:
            return ""
        on = format_date(decision.at, "long", locale=self._locale)
        return _("Checked and signed by {name}, {date}.").format(name=decision.by_name, date=on)

    def places(self) -> list[dict[str, Any]]:
        """The four areas in listening order."""
        looks = {look["key"]: look for look in place_looks()}
        return [
            self._place(name, self._outcome.areas[name], looks[name])
            for name in AREA_NAMES
            if name in self._outcome.areas
        ]

    def reasons(self) -> list[dict[str, str]]:
        """Why to take care, and what to do, in the page's language; a clinician who signed has weighed it."""
        if self._is_signed:
            return []
        return [{"message": self._(one.message), "advice": self._(one.advice)} for one in self._outcome.reasons]

    def how(self) -> list[str]:
        """How to listen, step by step."""
        _ = self._
        return [
            self.posture(),
            _("Warm the stethoscope's head in your hand. Bare skin, quiet room."),
            _("Press it flat and firmly. Do not talk, and hold the tube still."),
            _("Listen 10 to 20 seconds at each place, breathing normally."),
            _("Too much noise? Stop, turn off fans and the television, wait for calm, and press flat again."),
            _("If it is faint, move a finger-width and try again. Three calm tries, then stop and rest."),
        ]

    def not_diagnosis(self) -> str:
        """What it is not."""
        _ = self._
        return _(
            "These marks are an estimate for placing a stethoscope. They do not show whether a heart is healthy. "
            "A clinician must check them. Do not delay care because of this page."
        )

    def ring(self) -> str:
        """What the ring in the picture means."""
        _ = self._
        words = _("The coloured ring is the stethoscope's head in its true size, {diameter} mm across.")
        return words.format(diameter=round(self._chestpiece))

    def sheet(self) -> ListeningFacts:
        """What stands on the sheet to print."""
        _ = self._
        made_on = format_date(self._case.updated_at, "long", locale=self._locale)
        care = " ".join(f"{one['message']} {one['advice']}" for one in self.reasons()[:1])
        places = tuple(
            PlaceWords(place["key"], place["title"], place["instruction"], place["sureness"]) for place in self.places()
        )
        asked = _("Ask your clinician first: {reason}").format(reason=care) if care else ""
        whose = f"{self.whose()} {self.checked()}".strip()
        return ListeningFacts(whose, made_on, self.posture(), self._chestpiece, places, asked)

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
                (_("Skin fit (root mean square)"), self._mm(quality.surface_residual_mm)),
                (_("Landmark fit"), self._mm(quality.landmark_residual_mm)),
                (_("Spread between references"), self._mm(quality.spread_mm)),
                (_("Chest covered by the scan"), format_percent(quality.coverage, locale=self._locale)),
            ]
        method = self._outcome.method
        return [
            *measured,
            (_("Most similar reference"), self._outcome.selected or "–"),
            (_("Method"), f"{method.get('name', 'lubdub')} {method.get('version', '')}".strip()),
        ]

    @property
    def _is_signed(self) -> bool:
        return self._review.decision is not None

    @property
    def _is_plain(self) -> bool:
        return self._outcome.verdict == "show" or self._is_signed

    def _place(self, name: AreaName, area: Area, look: dict[str, Any]) -> dict[str, Any]:
        _ = self._
        titles = {
            "aortic": _("Aortic"),
            "pulmonary": _("Pulmonary"),
            "tricuspid": _("Tricuspid"),
            "mitral": _("Mitral"),
        }
        notch = self._notch()
        where = None if self._skin is None else whereabouts(self._skin, area.position, notch)
        found = area.instruction if where is None else instruction(where, self._language, self._person)
        sureness = self._reviewed(name) if self._is_signed else self._sureness(area.radius_mm)
        now = _("Place {number} of {count}: {title}")
        count = len(self._outcome.areas)
        side = float(area.position[0] - notch[0])
        aside = _("{distance} to the left") if side >= 0 else _("{distance} to the right")
        return {
            **look,
            "title": titles[name],
            "instruction": found,
            "sureness": sureness,
            "now": now.format(number=look["number"], count=count, title=titles[name]),
            "down_cm": self._tenths(float(notch[1] - area.position[1]) / 10),
            "side_cm": aside.format(distance=self._tenths(abs(side) / 10)),
            "radius_mm": f"{area.radius_mm:.0f}",
        }

    @property
    def _chestpiece(self) -> float:
        return chestpiece_mm(self._case.age_years)

    def _tenths(self, value: float) -> str:
        return str(format_decimal(value, "0.0", locale=self._locale))

    def _mm(self, value: float | None) -> str:
        return "–" if value is None else f"{self._tenths(value)}\u00a0mm"

    def _notch(self) -> np.ndarray:
        mark = self._outcome.landmarks.get("suprasternal_notch")
        return np.zeros(3) if mark is None else mark.position

    def _reviewed(self, name: AreaName) -> str:
        _ = self._
        is_moved = name in self._review.corrected
        return _("The clinician put this place here.") if is_moved else _("The clinician agrees with this place.")

    def _sureness(self, radius_mm: float) -> str:
        _ = self._
        if radius_mm > ASK_FIRST_MM:
            return _("Please ask your clinician before using this one.")
        half_cm = max(1, round(radius_mm / 5)) * 5 / 10
        words = _("We are sure to about {distance} cm.")
        if any(reason.code in DOUBTS for reason in self._outcome.reasons):
            words = _("Check the warning first. Without it we would be sure to about {distance} cm.")
        return words.format(distance=self._language.number(half_cm))


def language_in(locale: str) -> Language:
    """The sentences and numbers of a language."""
    said = words_of(locale)
    return Language(said.gettext, said.ngettext, lambda value: str(format_decimal(value, "0.#", locale=locale)))


def age_words(language: Language, age_years: float | None) -> str:
    """The age as one says it."""
    if age_years is None:
        return language.gettext("age not said")
    months = round(age_years * 12)
    if months < 24:
        return language.ngettext("{months} month old", "{months} months old", months).format(months=months)
    return language.gettext("{years} years old").format(years=months // 12)
