"""What a clinician reads of a reference body: who it is like, whose areas serve, and how far their own marks are."""

from __future__ import annotations

from typing import Any

from babel.numbers import format_decimal
from fastapi import Request

from lubdub.jobs.reference_marks import MarkedBody
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName
from lubdub.web.desk.review_words import area_words, landmark_words
from lubdub.web.languages import language_of
from lubdub.web.pages.look import gettext_of, place_looks
from lubdub.web.pages.result_words import age_words, language_in


class BodyWords:
    """The words about one body."""

    def __init__(self, request: Request, told: MarkedBody) -> None:
        self._, self._locale, self._told = gettext_of(request), language_of(request), told

    def row(self) -> dict[str, Any]:
        """A line of the list."""
        return {
            "name": self._told.card["id"],
            "person": self.person(),
            "placed_by": self._placed_by(),
            "spread": self._spread(),
            "mine": self._mine(),
        }

    def person(self) -> str:
        """Age and sex."""
        _, card = self._, self._told.card
        sexes = {"female": _("Female"), "male": _("Male")}
        return ", ".join(
            one for one in (sexes.get(card["sex"], ""), age_words(language_in(self._locale), card["age_years"])) if one
        )

    def areas(self, current: AreaName | None) -> list[dict[str, Any]]:
        """The four areas in listening order, and whether each is marked. current: the one in hand."""
        _, looks = self._, {look["key"]: look for look in place_looks()}
        placed = self._told.mine.areas
        return [
            {
                **looks[name],
                "title": area_words(_)[name],
                "state": _("marked") if name in placed else _("to be marked"),
                "is_seen": name in placed,
                "is_current": name == current,
            }
            for name in AREA_NAMES
        ]

    def upcoming(self, current: AreaName | None) -> dict[str, str] | None:
        """The area to take in hand next; None when all are marked."""
        missing = [name for name in AREA_NAMES if name not in self._told.mine.areas and name != current]
        if not missing and len(self._told.mine.areas) == len(AREA_NAMES):
            return None
        name = missing[0] if missing else current
        return None if name is None else {"key": name, "title": area_words(self._)[name]}

    def landmarks(self) -> list[str]:
        """The points shown as dots."""
        return [landmark_words(self._)[name] for name in LANDMARK_NAMES]

    def _placed_by(self) -> str:
        _, told = self._, self._told
        if told.spread_mm is None:
            return _("Anatomy table") if "case" not in told.card else str(told.card["placed_by"])
        outside = [_("a clinician of another organisation")] * told.outside
        return ", ".join((*told.placed_by, *outside))

    def _spread(self) -> list[dict[str, str]]:
        """How far the two who marked each area lie apart; empty before there are two."""
        spread = self._told.spread_mm or {}
        return [
            {"title": area_words(self._)[name], "far": f"{format_decimal(far, '0', locale=self._locale)}\u00a0mm"}
            for name, far in spread.items()
        ]

    def _mine(self) -> str:
        _, told = self._, self._told
        if told.mine.handed_in_at:
            return _("You have marked it")
        if told.is_full:
            return _("Marked by two others")
        if told.mine.areas:
            return _("You have begun")
        return _("Marked by one other") if told.others else _("Not marked yet")
