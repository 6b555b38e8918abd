"""Clinicians mark the areas on reference bodies, each without seeing another's marks or the table's places."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import BodyNotFound, ReviewMoved, StateConflict
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.sharing import Sharing
from lubdub.cases.values import SYSTEM, Actor
from lubdub.library.load import load_body
from lubdub.library.marks import MARKERS, agreement, drop_marks, read_marks, write_marks
from lubdub.library.marks import AreaMarks as AreaMarks
from lubdub.library.own import cards
from lubdub.results import AREA_NAMES, AreaName, Reference


@dataclass(frozen=True)
class MarkedBody:
    """A body as the list tells of it. others: how many beside the asker have handed in; mine: the asker's own marks.

    placed_by: whose areas serve, empty for the table's; outside: how many of them are of another organisation;
    spread_mm: how far those two lie apart.
    """

    card: dict[str, Any]
    mine: AreaMarks
    others: int
    placed_by: tuple[str, ...] = ()
    outside: int = 0
    spread_mm: dict[AreaName, float] | None = None

    @property
    def is_full(self) -> bool:
        """Whether others have marked it so that nobody more is asked."""
        return self.others >= MARKERS and not self.mine.handed_in_at

    @property
    def is_closed(self) -> bool:
        """Whether the asker can change nothing."""
        return self.is_full or bool(self.mine.handed_in_at)


class ReferenceMarks:
    """The marks of this installation. Raises BodyNotFound for bodies that are not there, or of other organisations.

    own: the folder that keeps them, None where there is none: nothing can be marked then.
    references: tells the folder that bodies are loaded from.
    """

    def __init__(self, database: Database, own: Path | None, references: Callable[[], Path | None]) -> None:
        self._database, self._sharing = database, Sharing(database)
        self._own, self._references = own, references
        self._lock = threading.Lock()

    @property
    def can_keep(self) -> bool:
        """Whether this installation has a folder for marks."""
        return self._own is not None

    def list_all(self, by: Reviewer) -> list[MarkedBody]:
        """Every body the clinician may mark, as they stand."""
        folder = self._references()
        marks = read_marks(folder)
        shown = [card for card in cards(folder) if not card.get("disabled") and self._is_shown(by.actor, card)]
        return [self._told(by, card, [one for one in marks if one.body == card["id"]]) for card in shown]

    def names(self) -> frozenset[str]:
        """The bodies that serve, for whoever they are."""
        return frozenset(card["id"] for card in cards(self._references()) if not card.get("disabled"))

    def body(self, by: Reviewer, name: str) -> Reference:
        """The body without any marks of people; its own areas are not to be shown."""
        self._card(by.actor, name)
        found = load_body(self._references(), name)
        if found is None:
            raise BodyNotFound
        return found

    def told(self, by: Reviewer, name: str) -> MarkedBody:
        """As the list tells of it."""
        return self._told(by, self._card(by.actor, name), read_marks(self._references(), name))

    def mine(self, by: Reviewer, name: str) -> AreaMarks:
        """What the clinician has marked on it."""
        return self.told(by, name).mine

    def note_reading(self, by: Reviewer, name: str) -> None:
        """Somebody looks at a body that was a patient's: a line of the audit trail, on that case."""
        case_id = self._card(by.actor, name).get("case")
        if case_id is not None:
            with self._database.writing() as session:
                audit.append(self._database, session, by.actor, "reference.read", case_id, now(), name)

    def place(self, by: Reviewer, name: str, version: int, area: AreaName, place: np.ndarray) -> AreaMarks:
        """Put an area there. place: (3,) on the skin, mm, the body's own frame.

        Raises ReviewMoved when the marks went on meanwhile, StateConflict after they were handed in.
        """
        return self._change(by, name, version, lambda marks: marks.with_step(area, place))

    def undo(self, by: Reviewer, name: str, version: int) -> AreaMarks:
        """Take the last step back."""

        def taken_back(marks: AreaMarks) -> AreaMarks:
            if not marks.steps:
                raise StateConflict("There is nothing to take back.")
            return marks.without_last()

        return self._change(by, name, version, taken_back)

    def hand_in(self, by: Reviewer, name: str, version: int) -> None:
        """From now on they count, and nothing of them changes. Raises StateConflict while an area is missing."""
        with self._database.writing() as session:
            self._note(session, by.actor, "reference.mark", name)  # holds off whoever hands in at the same moment
            told = self.told(by, name)
            marks = _open(told, version)
            if len(marks.areas) < len(AREA_NAMES):
                raise StateConflict("Mark all four areas first.")
            handed = replace(marks, by_name=by.name, version=marks.version + 1, handed_in_at=now().isoformat())
            write_marks(self._folder(), handed)

    def withdraw(self, by: Reviewer, name: str) -> None:
        """Take one's own marks away."""
        self._card(by.actor, name)
        self._drop(by.actor, name, by.actor.id, name)

    def withdraw_for(self, name: str, person: str) -> None:
        """Take somebody's marks away, by whoever runs the service. Raises StateConflict when there are none."""
        self._drop(SYSTEM, name, person, f"{person} {name}")

    def _drop(self, actor: Actor, name: str, person: str, detail: str) -> None:
        with self._database.writing() as session:
            if not drop_marks(self._folder(), name, person):
                raise StateConflict("There are no such marks.")
            audit.append(self._database, session, actor, "reference.withdraw", None, now(), detail)

    def _folder(self) -> Path:
        if self._own is None:
            raise StateConflict("This installation has no folder for marks: name one with LUBDUB_REFERENCES_DIR.")
        return self._own

    def _note(self, session: Session, actor: Actor, action: str, name: str) -> None:
        audit.append(self._database, session, actor, action, None, now(), name)

    def _change(self, by: Reviewer, name: str, version: int, how: Callable[[AreaMarks], AreaMarks]) -> AreaMarks:
        with self._lock:
            changed = how(_open(self.told(by, name), version))
            write_marks(self._folder(), changed)
            return changed

    def _told(self, by: Reviewer, card: dict[str, Any], marks: list[AreaMarks]) -> MarkedBody:
        valid = [one for one in marks if one.fits(card)]
        mine = next((one for one in valid if one.by == by.actor.id), None)
        begun = mine or AreaMarks(card["id"], card["sha256"], by.actor.id, by.name, by.actor.tenant_id)
        handed = [one for one in valid if one.handed_in_at]
        told = MarkedBody(card, begun, sum(one.by != by.actor.id for one in handed))
        if len(handed) < MARKERS:
            return told
        reference = load_body(self._references(), card["id"])
        agreed = None if reference is None else agreement(reference, handed)
        if agreed is None:
            return told
        ours = {one.by: one.by_name for one in handed if one.tenant == by.actor.tenant_id}
        known = tuple(ours[person] for person in agreed.people if person in ours)
        return replace(told, placed_by=known, outside=len(agreed.people) - len(known), spread_mm=dict(agreed.spread_mm))

    def _card(self, actor: Actor, name: str) -> dict[str, Any]:
        for card in cards(self._references()):
            if card["id"] == name and not card.get("disabled") and self._is_shown(actor, card):
                return card
        raise BodyNotFound

    def _is_shown(self, actor: Actor, card: dict[str, Any]) -> bool:
        """The bodies of patients are shown to their own organisation alone."""
        return "case" not in card or self._sharing.is_known_to(actor, card["case"])


def _open(told: MarkedBody, version: int) -> AreaMarks:
    if told.is_full:
        raise StateConflict("Two others have marked this body already.")
    if told.mine.handed_in_at:
        raise StateConflict("These marks were handed in. Withdraw them to mark this body again.")
    if version != told.mine.version:
        raise ReviewMoved("These marks went on in another window. Look at them as they are now.")
    return told.mine
