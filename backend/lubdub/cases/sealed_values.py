"""Values of a case's row that say where things are on its body, sealed under the case's key like its files."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases.database import Database
from lubdub.cases.models import CaseRow
from lubdub.cases.models_review import ReviewStepRow
from lubdub.cases.sealing import unwrap_key, value_key, wrap_key

SEALED = "sealed"
AT_ONCE = 200


def sealed(session: Session, case_id: str, value: Mapping[str, Any]) -> dict[str, Any]:
    """The value as it is kept in a column of JSON."""
    key = value_key(session.info["keys"].case_key_in(session, case_id))
    return {SEALED: base64.b64encode(wrap_key(key, json.dumps(dict(value)).encode(), _about(case_id))).decode()}


def opened(session: Session, case_id: str, kept: Mapping[str, Any]) -> dict[str, Any]:
    """The value again; one from before values were sealed as it is. Raises SealBroken."""
    if set(kept) != {SEALED}:
        return dict(kept)
    key = value_key(session.info["keys"].case_key_in(session, case_id))
    return dict(json.loads(unwrap_key(key, base64.b64decode(kept[SEALED]), _about(case_id))))


def seal_older(database: Database) -> int:
    """Seal what was kept before values were sealed; how many there were."""
    done = 0
    while True:
        with database.writing() as session:
            marks = session.scalars(
                sa.select(CaseRow)
                .where(CaseRow.landmarks.is_not(None), _is_plain(CaseRow.landmarks), CaseRow.deleted_at.is_(None))
                .limit(AT_ONCE)
            ).all()
            for row in marks:
                row.landmarks = sealed(session, row.id, row.landmarks or {})
            steps = session.scalars(sa.select(ReviewStepRow).where(_is_plain(ReviewStepRow.said)).limit(AT_ONCE)).all()
            for step in steps:
                step.said = sealed(session, step.case_id, step.said)
        if not marks and not steps:
            break
        done += len(marks) + len(steps)
    if done:
        database.forget_traces()
    return done


def _is_plain(column: Any) -> sa.ColumnElement[bool]:
    return sa.cast(column, sa.Text).not_like(f'{{"{SEALED}"%')


def _about(case_id: str) -> str:
    return f"value of {case_id}"
