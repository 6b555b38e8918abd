"""The fair order of jobs: who asks for a hundred does not keep another waiting for more than one of them.

Start-time fair queueing: each job gets the number of its turn, and lower turns go first. An owner's jobs have turns one
after the other; an owner with nothing at work begins where the queue is now, so that nobody saves up turns by being
idle and nobody who keeps coming overtakes what waits already.
"""

from __future__ import annotations

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases.models import CaseRow
from lubdub.cases.states import IN_WORK
from lubdub.cases.values import FAMILIES


def next_turn(session: Session, row: CaseRow) -> int:
    """The turn of a new job of this case, from 1. A portal is one owner; of families, each is one."""
    at_work = CaseRow.status.in_(IN_WORK) & CaseRow.deleted_at.is_(None) & (CaseRow.id != row.id)
    front = session.scalar(sa.select(sa.func.min(CaseRow.job_turn)).where(at_work))
    last = session.scalar(sa.select(sa.func.max(CaseRow.job_turn)).where(at_work, _same_owner(row)))
    return max(front or 1, (last or 0) + 1)


def _same_owner(row: CaseRow) -> sa.ColumnElement[bool]:
    if row.tenant_id == FAMILIES:
        return CaseRow.owner_session_id == row.owner_session_id
    return CaseRow.tenant_id == row.tenant_id
