"""Steps every change of a case is made of: find the row, set its state, tell listeners, write the audit line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit, outbox
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import CaseNotFound
from lubdub.cases.models import CaseEventRow, CaseRow, FileRow, TenantRow
from lubdub.cases.sealed_values import opened
from lubdub.cases.states import JobKind, Status
from lubdub.cases.turns import next_turn
from lubdub.cases.values import FAMILIES, Actor, Case, Guide, Job


def visible_to(actor: Actor) -> sa.ColumnElement[bool]:
    """Which rows an actor may know of: a portal or clinician the tenant's, a family its own session's, the system all.

    Clinicians of the organisation that takes families also see what these sent, until they take it back
    or change it.
    """
    living = CaseRow.deleted_at.is_(None)
    if actor.kind == "system":
        return living
    if actor.kind == "family":
        return living & (CaseRow.owner_session_id == actor.id)
    own = CaseRow.tenant_id == actor.tenant_id
    if actor.kind == "key":
        return living & own
    takes = sa.exists().where(TenantRow.id == actor.tenant_id, TenantRow.takes_families)
    return living & (own | ((CaseRow.tenant_id == FAMILIES) & CaseRow.is_sent & takes))


def find(session: Session, actor: Actor, case_id: str, *, to_change: bool = False) -> CaseRow:
    """The row, locked when it is to change. Raises CaseNotFound."""
    query = sa.select(CaseRow).where(CaseRow.id == case_id, visible_to(actor))
    row = session.scalar(query.with_for_update() if to_change else query)
    if row is None:
        raise CaseNotFound(case_id)
    return row


@dataclass(frozen=True)
class Step:
    """One change of state. reason: shown to people; stage: what is being done now."""

    status: Status
    action: str
    stage: str | None = None
    fraction: float = 0.0
    reason: Mapping[str, str] | None = None


def take(database: Database, session: Session, row: CaseRow, actor: Actor, step: Step) -> None:
    """Make the change, its event and its one audit line."""
    moment = now()
    row.status, row.stage, row.fraction = step.status, step.stage, step.fraction
    row.reason = None if step.reason is None else dict(step.reason)
    add_event(session, row, "status", moment)
    outbox.tell(session, row.tenant_id, row.id, row.status, moment)
    audit.append(database, session, actor, step.action, row.id, moment, step.status)


def add_event(session: Session, row: CaseRow, kind: str, moment: datetime) -> None:
    """Tell whoever listens how the case stands now."""
    row.updated_at = moment
    row.last_event += 1
    data = {"status": row.status, "stage": row.stage, "fraction": row.fraction, "reason": row.reason}
    session.add(CaseEventRow(case_id=row.id, sequence=row.last_event, kind=kind, data=data, at=moment))


def new_job(session: Session, row: CaseRow, kind: JobKind) -> Job:
    """The next piece of work on this case; what was at work before is thereby out of date."""
    row.job_number += 1
    row.job_id = f"{row.id}.{kind}.{row.job_number}"
    row.job_starts, row.job_turn = 0, next_turn(session, row)
    return Job(row.job_id, row.id, kind, row.job_turn)


def job_of(job_id: str, turn: int = 1) -> Job:
    """The job an id names."""
    case_id, kind, _ = job_id.split(".")
    return Job(job_id, case_id, "check" if kind == "check" else "locate", turn)


def has_file(session: Session, case_id: str, artefact: str) -> bool:
    """Whether the case has this artefact."""
    return session.get(FileRow, (case_id, artefact)) is not None


def marks_of(session: Session, row: CaseRow) -> dict[str, list[float]] | None:
    """The landmarks that were placed."""
    return None if row.landmarks is None else opened(session, row.id, row.landmarks)


def to_value(session: Session, row: CaseRow) -> Case:
    """The row as the value this room hands out."""
    return Case(
        id=row.id,
        tenant_id=row.tenant_id,
        owner_session_id=row.owner_session_id,
        external_id=row.external_id,
        status=row.status,  # type: ignore[arg-type]  # only Status words are ever written
        age_years=row.age_years,
        sex=row.sex,  # type: ignore[arg-type]
        posture=row.posture,  # type: ignore[arg-type]
        answers=row.answers,  # type: ignore[arg-type]
        unit=row.unit,
        method=row.method,  # type: ignore[arg-type]
        landmarks=marks_of(session, row),
        job_id=row.job_id,
        stage=row.stage,
        fraction=row.fraction,
        reason=row.reason,
        created_at=row.created_at,
        updated_at=row.updated_at,
        has_scan=has_file(session, row.id, "scan"),
        is_checked=has_file(session, row.id, "examination.npz"),
        person=row.person,  # type: ignore[arg-type]
        consent=row.consent,
        guide=Guide(row.guide_app, row.guide_is_read),
        is_sent=row.is_sent,
        is_shared=row.sharing is not None,
        is_held=row.hold is not None,
    )
