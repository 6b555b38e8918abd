"""Every query a worker makes: take a job up, tell how far it is, hand its result in once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any, Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import StartedTooOften
from lubdub.cases.files import Artefact, FileVault, attach
from lubdub.cases.models import CaseRow, WorkerRow
from lubdub.cases.models_webhooks import DeliveryRow
from lubdub.cases.rows import Step, add_event, job_of, take, to_value
from lubdub.cases.states import IN_WORK, Status
from lubdub.cases.values import SYSTEM, Case, Job

MAX_STARTS = 3
"""A job that takes its worker down with it this often is given up."""


@dataclass(frozen=True)
class Handed:
    """What a job ends with. files: artefact -> plain bytes; reason: in words, when nothing is shown."""

    status: Literal["awaiting_landmarks", "done", "refused", "failed"]
    files: Mapping[Artefact, bytes] = field(default_factory=dict)
    reason: Mapping[str, str] | None = None


@dataclass(frozen=True)
class Seen:
    """A worker's last sign of life. sandbox: the limits of its children, and what else is taken from them."""

    name: str
    solver: str
    at: datetime
    sandbox: Mapping[str, Any]


class WorkDesk:
    """The cases, as a worker sees them. A job that is no longer its case's current one changes nothing."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and vault."""
        self._database = database
        self._vault = vault

    def take_up(self, job: Job) -> Case | None:
        """The case to work on, now marked as at work; None when the job is out of date.

        May be repeated, so and so often: raises StartedTooOften.
        """
        with self._database.writing() as session:
            row = _current(session, job)
            if row is None:
                return None
            if row.job_starts >= MAX_STARTS:
                raise StartedTooOften(job.id)
            row.job_starts += 1
            if row.status == "queued":
                take(self._database, session, row, SYSTEM, Step("running", "job.start"))
            return to_value(session, row)

    def put_back(self, job: Job) -> None:
        """A worker that is told to stop leaves the job to another one: this start does not count."""
        with self._database.writing() as session:
            row = _current(session, job)
            if row is not None:
                row.job_starts = max(row.job_starts - 1, 0)

    def is_current(self, job: Job) -> bool:
        """Whether anybody still waits for this job: False after a cancel, a deletion or a newer job."""
        with self._database.reading() as session:
            return _current(session, job, to_change=False) is not None

    def tell(self, job: Job, stage: str, fraction: float) -> None:
        """How far the job is. fraction: 0 to 1."""
        with self._database.writing() as session:
            row = _current(session, job)
            if row is not None:
                row.stage, row.fraction = stage[:32], min(max(fraction, 0.0), 1.0)
                add_event(session, row, "progress", now())

    def hand_in(self, job: Job, handed: Handed) -> bool:
        """Store the result, once: files and state change together. False when nobody waits for it any more.

        A run that a clinician asked for goes back to the clinician.
        """
        if not self.is_current(job):
            return False
        sealed = {name: self._vault.seal(job.case_id, name, data) for name, data in handed.files.items()}
        with self._database.writing() as session:
            row = _current(session, job)
            if row is None:
                left_over = [file.object_key for file in sealed.values()]
            else:
                left_over = attach(session, job.case_id, sealed)
                is_awaited = handed.status == "done" and row.is_sent
                ended: Status = "in_review" if is_awaited else handed.status
                step = Step(ended, f"job.{job.kind}", fraction=1.0, reason=handed.reason)
                take(self._database, session, row, SYSTEM, step)
        self._vault.discard(job.case_id, left_over)
        return row is not None

    def waiting(self, older_than: timedelta = timedelta(0)) -> list[Job]:
        """Jobs somebody waits for, asked for at least so long ago."""
        query = sa.select(CaseRow.job_id, CaseRow.job_turn).where(
            CaseRow.status.in_(IN_WORK),
            CaseRow.deleted_at.is_(None),
            CaseRow.job_id.is_not(None),
            CaseRow.updated_at <= now() - older_than,
        )
        with self._database.reading() as session:
            return [job_of(job_id, turn) for job_id, turn in session.execute(query) if job_id is not None]

    def whats_waiting(self) -> list[tuple[str, int, datetime | None]]:
        """(what, how many, since when the oldest): jobs by their case's state, and messages that are due."""
        jobs = (
            sa.select(CaseRow.status, sa.func.count(), sa.func.min(CaseRow.updated_at))
            .where(CaseRow.status.in_(IN_WORK), CaseRow.deleted_at.is_(None))
            .group_by(CaseRow.status)
        )
        messages = sa.select(sa.func.count(), sa.func.min(DeliveryRow.due_at)).where(DeliveryRow.due_at <= now())
        with self._database.reading() as session:
            found = {status: (number, since) for status, number, since in session.execute(jobs)}
            due, oldest = session.execute(messages).one()
        return [(status, *found.get(status, (0, None))) for status in IN_WORK] + [("messages", due, oldest)]

    def beat(self, name: str, solver: str, sandbox: Mapping[str, Any]) -> None:
        """A sign of life from a worker."""
        with self._database.writing() as session:
            session.merge(WorkerRow(name=name, solver=solver, seen_at=now(), sandbox=dict(sandbox)))

    def seen_within(self, span: timedelta) -> list[Seen]:
        """The workers that gave a sign of life lately, the last one first."""
        query = sa.select(WorkerRow).where(WorkerRow.seen_at >= now() - span).order_by(WorkerRow.seen_at.desc())
        with self._database.reading() as session:
            return [Seen(row.name, row.solver, row.seen_at, row.sandbox or {}) for row in session.scalars(query)]


def _current(session: Session, job: Job, *, to_change: bool = True) -> CaseRow | None:
    states: tuple[Status, ...] = ("checking",) if job.kind == "check" else ("queued", "running")
    query = sa.select(CaseRow).where(
        CaseRow.id == job.case_id,
        CaseRow.job_id == job.id,
        CaseRow.status.in_(states),
        CaseRow.deleted_at.is_(None),
    )
    return session.scalar(query.with_for_update() if to_change else query)
