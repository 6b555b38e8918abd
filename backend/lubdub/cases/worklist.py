"""The clinicians' list of cases: those that wait for a review first."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.models import CaseEventRow, CaseRow
from lubdub.cases.rows import to_value, visible_to
from lubdub.cases.states import DECIDED, IN_WORK, Status
from lubdub.cases.values import Actor, Case

Shelf = Literal["waiting", "decided", "under_way", "all"]
SHELVES: dict[Shelf, tuple[Status, ...]] = {
    "waiting": ("in_review",),
    "decided": DECIDED,
    "under_way": ("awaiting_scan", "awaiting_landmarks", *IN_WORK, "done", "refused", "failed"),
    "all": (),
}
"""Which states lie where; `all` has every one."""
MOST_SHOWN = 200


@dataclass(frozen=True)
class Entry:
    """A case, and since when it is in its state."""

    case: Case
    since: datetime


class Worklist:
    """What clinicians have to do, as far as each of them may know of it."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def entries(self, actor: Actor, shelf: Shelf = "waiting", search: str = "") -> list[Entry]:
        """The cases on a shelf, those that wait first and the longest waiting before them all.

        search: a part of the portal's own id, or the beginning of ours.
        """
        since = (
            sa.select(sa.func.max(CaseEventRow.at))
            .where(CaseEventRow.case_id == CaseRow.id, CaseEventRow.kind == "status")
            .scalar_subquery()
        )
        waits = sa.case((CaseRow.status == "in_review", 0), else_=1)
        newest = sa.case((CaseRow.status == "in_review", None), else_=since)
        query = (
            sa.select(CaseRow, since)
            .where(visible_to(actor), *_wanted(shelf, search))
            .order_by(waits, newest.desc(), since, CaseRow.id)
            .limit(MOST_SHOWN)
        )
        with self._database.reading() as session:
            return [Entry(to_value(session, row), at or row.updated_at) for row, at in session.execute(query)]

    def counts(self, actor: Actor) -> dict[Shelf, int]:
        """How many cases lie on each shelf."""
        query = sa.select(CaseRow.status, sa.func.count()).where(visible_to(actor)).group_by(CaseRow.status)
        with self._database.reading() as session:
            by_status = dict(session.execute(query).all())
        return {
            shelf: sum(count for status, count in by_status.items() if not states or status in states)
            for shelf, states in SHELVES.items()
        }

    def state(self, actor: Actor) -> str:
        """Another text whenever a case of the list changed, came or went."""
        events = sa.func.coalesce(sa.func.sum(CaseRow.last_event), 0)
        query = sa.select(sa.func.count(), events, sa.func.max(CaseRow.updated_at)).where(visible_to(actor))
        with self._database.reading() as session:
            count, happened, latest = session.execute(query).one()
        return f"{count}.{happened}.{latest}"


def _wanted(shelf: Shelf, search: str) -> list[sa.ColumnElement[bool]]:
    states, words = SHELVES[shelf], search.strip()
    wanted: list[sa.ColumnElement[bool]] = [CaseRow.status.in_(states)] if states else []
    if words:
        wanted.append(
            CaseRow.external_id.icontains(words, autoescape=True) | CaseRow.id.istartswith(words, autoescape=True)
        )
    return wanted
