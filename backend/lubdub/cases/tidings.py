"""How far the stories of the cases have come that somebody is told of."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.models import CaseEventRow, CaseRow


class Standing(NamedTuple):
    """Whose the case is, when it is a family's, and the number of its last event; 0 before the first."""

    owner: str | None
    last_event: int


class Tidings:
    """Looks many cases up at once, so that telling of them costs the database the same however many listen."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def of(self, case_ids: Collection[str]) -> Mapping[str, Standing]:
        """Case id -> how far it has come. A deleted case is missing."""
        if not case_ids:
            return {}
        rows = (
            sa.select(CaseRow.id, CaseRow.owner_session_id, sa.func.max(CaseEventRow.sequence))
            .outerjoin(CaseEventRow, CaseEventRow.case_id == CaseRow.id)
            .where(CaseRow.id.in_(case_ids), CaseRow.deleted_at.is_(None))
            .group_by(CaseRow.id, CaseRow.owner_session_id)
        )
        with self._database.reading() as session:
            return {case_id: Standing(owner, last or 0) for case_id, owner, last in session.execute(rows)}
