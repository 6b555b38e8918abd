"""The legal hold: while it stands, a case is neither deleted nor purged. Who sets or lifts it says why."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import StateConflict
from lubdub.cases.models import CaseRow
from lubdub.cases.rows import find, visible_to
from lubdub.cases.values import Actor

LONGEST_REASON = 200


@dataclass(frozen=True)
class Hold:
    """A hold that stands. by: kind and id of who set it."""

    case_id: str
    by: str
    reason: str
    since: datetime


class Holds:
    """The holds on the actor's cases. Raises CaseNotFound for those of others."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def place(self, actor: Actor, case_id: str, reason: str) -> Hold:
        """Hold the case. Raises ValueError without a reason, StateConflict when it is held already."""
        said = _said(reason)
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if row.hold is not None:
                raise StateConflict("This case is under a legal hold already.")
            moment = now()
            row.hold = {"by": actor.name, "reason": said, "since": moment.isoformat()}
            audit.append(self._database, session, actor, "case.hold", row.id, moment, said)
            return _hold(row)

    def lift(self, actor: Actor, case_id: str, reason: str) -> None:
        """Let the case go its way again. Raises ValueError without a reason, StateConflict when it is not held."""
        said = _said(reason)
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if row.hold is None:
                raise StateConflict("This case is not under a legal hold.")
            row.hold = None
            audit.append(self._database, session, actor, "case.release", row.id, now(), said)

    def get(self, actor: Actor, case_id: str) -> Hold | None:
        """The hold on a case, if one stands."""
        with self._database.reading() as session:
            row = find(session, actor, case_id)
            return None if row.hold is None else _hold(row)

    def list_all(self, actor: Actor) -> list[Hold]:
        """All that stand, the case opened first in front."""
        query = sa.select(CaseRow).where(visible_to(actor), CaseRow.hold.is_not(None)).order_by(CaseRow.created_at)
        with self._database.reading() as session:
            return [_hold(row) for row in session.scalars(query)]


def _said(reason: str) -> str:
    words = " ".join(reason.split())
    if not words:
        raise ValueError("Say why, in a few words that name nobody.")
    if len(words) > LONGEST_REASON:
        raise ValueError(f"Say why in at most {LONGEST_REASON} characters.")
    return words


def _hold(row: CaseRow) -> Hold:
    said = row.hold or {}
    return Hold(row.id, said["by"], said["reason"], datetime.fromisoformat(said["since"]))
