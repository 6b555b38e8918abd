"""A portal's cases, page by page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from datetime import UTC, datetime

import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.errors import BadCursor
from lubdub.cases.models import CaseRow
from lubdub.cases.rows import to_value, visible_to
from lubdub.cases.states import Status
from lubdub.cases.values import Actor, Case


@dataclass(frozen=True)
class Wanted:
    """Which cases are asked for. cursor: where the page before ended, None for the first."""

    limit: int
    cursor: str | None = None
    status: Status | None = None
    external_id: str | None = None


@dataclass(frozen=True)
class CasePage:
    """Cases, newest first. next_cursor: asks for the page after this one; None when there is none."""

    cases: tuple[Case, ...]
    next_cursor: str | None


class CaseList:
    """Pages that neither skip nor repeat a case, whatever is opened or deleted between two calls."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def page(self, actor: Actor, wanted: Wanted) -> CasePage:
        """One page of the actor's cases. Raises BadCursor."""
        query = sa.select(CaseRow).where(visible_to(actor)).order_by(CaseRow.created_at.desc(), CaseRow.id.desc())
        if wanted.status is not None:
            query = query.where(CaseRow.status == wanted.status)
        if wanted.external_id is not None:
            query = query.where(CaseRow.external_id == wanted.external_id)
        if wanted.cursor is not None:
            created_at, case_id = _place(wanted.cursor)
            older = sa.and_(CaseRow.created_at == created_at, CaseRow.id < case_id)
            query = query.where(sa.or_(CaseRow.created_at < created_at, older))
        with self._database.reading() as session:
            rows = list(session.scalars(query.limit(wanted.limit + 1)))
            shown = rows[: wanted.limit]
            cases = tuple(to_value(session, row) for row in shown)
            return CasePage(cases, _cursor(shown[-1]) if len(rows) > len(shown) else None)


def _cursor(row: CaseRow) -> str:
    said = f"{row.created_at.isoformat()} {row.id}"
    return base64.urlsafe_b64encode(said.encode()).decode().rstrip("=")


def _place(cursor: str) -> tuple[datetime, str]:
    try:
        said = base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode()
        moment, _, case_id = said.partition(" ")
        return datetime.fromisoformat(moment).astimezone(UTC), case_id
    except (ValueError, OverflowError) as error:
        raise BadCursor(cursor) from error
