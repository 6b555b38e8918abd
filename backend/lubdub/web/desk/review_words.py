"""What a clinician reads of a result: who it is of, the areas and how they stand, and the numbers that matter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from babel.dates import format_datetime
from babel.numbers import format_decimal, format_percent
from fastapi import Request

from lubdub.cases.review_reasons import RETURN_REASONS, UNUSABLE_REASONS
from lubdub.cases.reviewing import Review, Reviewer
from lubdub.cases.values import Case
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, Outcome, Reason
from lubdub.web.languages import language_of
from lubdub.web.pages.look import gettext_of, place_looks
from lubdub.web.pages.result_words import age_words, language_in


@dataclass(frozen=True)
class Stand:
    """How things are when a page is written. current: the area looked at last in this window."""

    case: Case
    outcome: Outcome
    now: Outcome
    review: Review
    by: Reviewer
    current: AreaName | None = None


class ReviewWords:
    """The words of the review page. stand.outcome is as computed, stand.now with corrections."""

    def __init__(self, request: Request, stand: Stand) -> None:
        self._ = gettext_of(request)
        self._locale = language_of(request)
        self._stand = stand

    def areas(self) -> list[dict[str, Any]]:
        """The four areas in the order to go through them."""
        unseen = self._stand.review.unseen_by(self._stand.by.actor)
        looks = {look["key"]: look for look in place_looks()}
        return [
            {
                **looks[name],
                "title": area_words(self._)[name],
                "state": self._state(name, name in unseen),
                "is_seen": name not in unseen,
                "is_current": name == self._stand.current,
                "radius": f"{self._stand.outcome.areas[name].radius_mm:.0f}",
            }
            for name in AREA_NAMES
            if name in self._stand.now.areas
        ]

    def upcoming(self) -> dict[str, str] | None:
        """The area to look at next; None when all were seen."""
        unseen = self._stand.review.unseen_by(self._stand.by.actor)
        after = self._stand.current
        start = 0 if after is None else AREA_NAMES.index(after) + 1
        ordered = [*AREA_NAMES[start:], *AREA_NAMES[:start]]
        name = next((one for one in ordered if one in unseen), None)
        return None if name is None else {"key": name, "title": area_words(self._)[name]}

    def person(self) -> str:
        """Age, sex and posture in one line."""
        _, case = self._, self._stand.case
        sexes = {"female": _("Female"), "male": _("Male")}
        postures = {"supine": _("lying"), "sitting": _("sitting")}
        sex = sexes.get(case.sex or "", "")
        return ", ".join(
            one
            for one in (sex, age_words(language_in(self._locale), case.age_years), postures.get(case.posture, ""))
            if one
        )

    def verdict(self) -> str:
        """What the program itself thinks of it."""
        _ = self._
        return _("No concern found") if self._stand.outcome.verdict == "show" else _("To be used with care")

    def reasons(self) -> list[str]:
        """Why with care."""
        return [self._(one.message) for one in self._stand.outcome.reasons]

    def numbers(self) -> list[dict[str, str]]:
        """Name, value and meaning of each number."""
        _, quality = self._, self._stand.outcome.quality
        if quality is None:
            return []
        covered = format_percent(quality.coverage, locale=self._locale)
        said = [
            (_("Skin fit (root mean square)"), self._mm(quality.surface_residual_mm), _("From scan to fitted body")),
            (_("Landmark fit"), self._mm(quality.landmark_residual_mm), _("From marked to fitted points")),
            (_("Chest covered by the scan"), covered, _("Of the front, from notch to apex")),
            (_("Spread between references"), self._mm(quality.spread_mm), _("How far their areas differ")),
        ]
        return [{"name": name, "value": value, "meaning": meaning} for name, value, meaning in said]

    def references(self) -> list[str]:
        """Which reference bodies had a say, and how much of it."""
        used = sorted(self._stand.outcome.references, key=lambda one: -one.weight)
        return [f"{one.id} ({format_percent(one.weight, locale=self._locale)})" for one in used if one.weight >= 0.005]

    def method(self) -> str:
        """Name and version: all that a repeat needs stands in the result."""
        method = self._stand.outcome.method
        return f"{method.get('name', 'lubdub')} {method.get('version', '')}".strip()

    def landmarks(self) -> list[dict[str, Any]]:
        """Each landmark, and where it came from."""
        _ = self._
        sources = {"given": _("marked by hand"), "suggested": _("found by the program"), "sticker": _("sticker")}
        known, moved = self._stand.outcome.landmarks, self._stand.review.landmarks
        return [
            {
                "key": name,
                "number": number,
                "title": landmark_words(_)[name],
                "source": _("moved: run again") if name in moved else sources[known[name].source],
            }
            for number, name in enumerate(LANDMARK_NAMES, start=1)
            if name in known
        ]

    def decision(self) -> str:
        """Who decided what, and when; empty while the review goes on."""
        _, decision = self._, self._stand.review.decision
        if decision is None:
            return ""
        done = {"sign": _("Signed"), "return": _("Returned"), "unusable": _("Marked unusable")}[decision.deed]
        at = format_datetime(decision.at, "short", locale=self._locale)
        return f"{done}: {decision.by_name}, {at}"

    def _state(self, name: AreaName, is_unseen: bool) -> str:
        _, review = self._, self._stand.review
        moved = review.corrected.get(name)
        if moved is None:
            return _("to be looked at") if is_unseen else _("looked at")
        off = self._stand.now.areas[name].position - self._stand.outcome.areas[name].position
        far = self._mm(float(np.linalg.norm(off)))
        said = _("moved {distance} by {name}").format(distance=far, name=moved.by_name)
        return said + (f", {_('to be looked at')}" if is_unseen else "")

    def _mm(self, value: float | None) -> str:
        return "–" if value is None else f"{format_decimal(value, '0.0', locale=self._locale)}\u00a0mm"


def area_words(gettext: Any) -> dict[AreaName, str]:
    """The four areas' names."""
    _ = gettext
    return {
        "aortic": _("Aortic"),
        "pulmonary": _("Pulmonary"),
        "tricuspid": _("Tricuspid"),
        "mitral": _("Mitral"),
    }


def landmark_words(gettext: Any) -> dict[str, str]:
    """The landmarks as clinicians call them."""
    _ = gettext
    return {
        "suprasternal_notch": _("Suprasternal notch"),
        "xiphisternum": _("Xiphisternal joint"),
        "navel": _("Navel"),
        "nipple_left": _("Left nipple"),
        "nipple_right": _("Right nipple"),
    }


def choices(gettext: Any, reasons: dict[str, Reason]) -> list[tuple[str, str]]:
    """Code and sentence of each reason of a list."""
    return [(code, gettext(reason.message)) for code, reason in reasons.items()]


def decline_choices(gettext: Any) -> dict[str, list[tuple[str, str]]]:
    """The two short lists: to return a case, and to mark it unusable."""
    return {"back": choices(gettext, RETURN_REASONS), "unusable": choices(gettext, UNUSABLE_REASONS)}


def state_words(gettext: Any) -> dict[str, str]:
    """Each state of a case as the desk says it."""
    _ = gettext
    return {
        "awaiting_scan": _("Waits for a scan"),
        "checking": _("At work"),
        "awaiting_landmarks": _("Waits for the points"),
        "queued": _("At work"),
        "running": _("At work"),
        "done": _("Not sent yet"),
        "in_review": _("Waits for review"),
        "reviewed": _("Signed"),
        "returned": _("Returned"),
        "unusable": _("Marked unusable"),
        "refused": _("Refused by the program"),
        "failed": _("Failed"),
    }
