"""The audit trail: who did what, when; append only, each line's hash sealed onto the line before."""

from __future__ import annotations

import hashlib
import json
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases.database import Database
from lubdub.cases.models import AuditRow
from lubdub.cases.values import Actor

FIRST = "0" * 64


def append(
    database: Database, session: Session, actor: Actor, action: str, case_id: str | None, at: datetime, detail: str = ""
) -> str:
    """Add a line inside the caller's transaction and return its hash. detail: never anything clinical.

    The chain's end is locked until the transaction is over, so that lines follow each other without a gap.
    """
    database.lock_audit(session)
    last = session.execute(
        sa.select(AuditRow.sequence, AuditRow.sha256).order_by(AuditRow.sequence.desc()).limit(1)
    ).first()
    row = AuditRow(
        sequence=1 if last is None else last.sequence + 1,
        at=at,
        actor=actor.name,
        action=action,
        case_id=case_id,
        detail=detail,
        previous_sha256=FIRST if last is None else last.sha256,
        sha256="",
    )
    row.sha256 = line_sha256(row)
    session.add(row)
    return row.sha256


def line_sha256(row: AuditRow) -> str:
    """The hash of a line together with the hash of the line before."""
    said = [row.sequence, row.at.isoformat(), row.actor, row.action, row.case_id, row.detail, row.previous_sha256]
    return hashlib.sha256(json.dumps(said).encode()).hexdigest()


def first_broken_line(database: Database) -> int | None:
    """The sequence number of the first line that does not fit the chain, or None when all is well."""
    previous, expected = FIRST, 1
    with database.reading() as session:
        for row in session.scalars(sa.select(AuditRow).order_by(AuditRow.sequence)):
            sound = row.sequence == expected and row.previous_sha256 == previous and row.sha256 == line_sha256(row)
            if not sound:
                return row.sequence
            previous, expected = row.sha256, expected + 1
    return None
