"""Every query a person's or a portal's call makes. Each change is one transaction with one audit line."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import StateConflict
from lubdub.cases.family_invitations import belong
from lubdub.cases.files import OF_CHECK, OF_SCAN, FileVault, Sealed, attach, detach
from lubdub.cases.models import CaseEventRow, CaseKeyRow, CaseRow
from lubdub.cases.repeating import Repeatable, remember, remembered
from lubdub.cases.rows import Step, find, has_file, new_job, take, to_value, visible_to
from lubdub.cases.screening import stop_reason
from lubdub.cases.sealed_values import sealed
from lubdub.cases.states import AFTER_CANCEL, IN_WORK, TAKES_LANDMARKS, TAKES_SCAN, Status
from lubdub.cases.values import Actor, Case, CaseEvent, Guide, Job, NewCase


@dataclass(frozen=True)
class Asked:
    """What is asked of a run. landmarks: name -> [x, y, z] in the file's own coordinates and unit."""

    landmarks: Mapping[str, Sequence[float]]
    unit: Literal["m", "cm", "mm"] | None = None
    method: Literal["lubdub", "paper", "rule"] = "lubdub"


@dataclass(frozen=True)
class Standing:
    """How long a case has been in its state, and its place in the queue."""

    since: datetime
    ahead: int


class CaseStore:
    """The cases, as people and portals see and change them. Raises CaseNotFound for those of others."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and the vault that makes cases' keys."""
        self._database = database
        self._vault = vault

    def create(self, actor: Actor, new: NewCase, repeatable: Repeatable | None = None) -> tuple[Case, bool]:
        """Open a case; the flag is False when an earlier call with the same idempotency key opened it.

        A stop question answered yes makes a case that is refused from the start.
        Raises IdempotencyMismatch when the key came with another call.
        """
        try:
            return self._create(actor, new, repeatable)
        except IntegrityError:
            if repeatable is None:
                raise
            return self._create(actor, new, repeatable)  # the same call at the same moment was quicker

    def _create(self, actor: Actor, new: NewCase, repeatable: Repeatable | None) -> tuple[Case, bool]:
        with self._database.writing() as session:
            known = remembered(session, actor, repeatable)
            if known is not None:
                return to_value(session, find(session, actor, known)), False
            row = _new_row(actor, new)
            belong(session, row, actor, new)
            session.add(row)
            session.flush()
            session.add(
                CaseKeyRow(case_id=row.id, wrapped_key=self._vault.new_wrapped_key(row.id), created_at=row.created_at)
            )
            reason = stop_reason(new.answers)
            step = Step("awaiting_scan", "case.create")
            if reason is not None:
                step = Step("refused", "case.create", reason=reason.to_json())
            take(self._database, session, row, actor, step)
            remember(session, actor, repeatable, row.id)
            session.flush()
            return to_value(session, row), True

    def get(self, actor: Actor, case_id: str) -> Case:
        """The case as it stands."""
        with self._database.reading() as session:
            return to_value(session, find(session, actor, case_id))

    def has(self, actor: Actor, case_id: str) -> bool:
        """Whether the actor may know of the case."""
        with self._database.reading() as session:
            query = sa.select(CaseRow.id).where(CaseRow.id == case_id, visible_to(actor))
            return session.scalar(query) is not None

    def note_reading(self, actor: Actor, case_id: str, action: str) -> Case:
        """The case, with a line in the audit trail that the actor looks at something of the person's body."""
        with self._database.writing() as session:
            row = find(session, actor, case_id)
            audit.append(self._database, session, actor, action, row.id, now())
            return to_value(session, row)

    def list_cases(self, actor: Actor, limit: int = 50) -> list[Case]:
        """The actor's cases, newest first."""
        query = sa.select(CaseRow).where(visible_to(actor)).order_by(CaseRow.created_at.desc()).limit(limit)
        with self._database.reading() as session:
            return [to_value(session, row) for row in session.scalars(query)]

    def expect_scan(self, actor: Actor, case_id: str) -> Case:
        """The case, if a scan may come in now. Raises StateConflict."""
        with self._database.reading() as session:
            row = find(session, actor, case_id)
            _must_take_scan(row)
            return to_value(session, row)

    def receive_scan(self, actor: Actor, case_id: str, scan: Sealed, unit: str | None) -> tuple[Case, Job]:
        """Make the written file the case's scan and ask for its check; all that came from an older scan goes.

        unit: m, cm, mm, or None to find it. Raises StateConflict.
        """
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            _must_take_scan(row)
            dropped = detach(session, case_id)
            attach(session, case_id, {"scan": scan})
            row.unit, row.landmarks, row.is_sent = unit, None, False
            job = new_job(session, row, "check")
            take(self._database, session, row, actor, Step("checking", "scan.receive"))
            case = to_value(session, row)
        self._vault.discard(case_id, dropped)
        return case, job

    def check_again(self, actor: Actor, case_id: str, unit: str) -> tuple[Case, Job]:
        """Examine the same scan once more, in the unit a person said it has. Raises StateConflict."""
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            _must_take_scan(row)
            if not has_file(session, case_id, "scan"):
                raise StateConflict("There is no scan yet. Send it first.")
            dropped = detach(session, case_id, but=OF_SCAN)
            row.unit, row.landmarks, row.is_sent = unit, None, False
            job = new_job(session, row, "check")
            take(self._database, session, row, actor, Step("checking", "scan.unit"))
            case = to_value(session, row)
        self._vault.discard(case_id, dropped)
        return case, job

    def place_landmarks(
        self, actor: Actor, case_id: str, asked: Asked, repeatable: Repeatable | None = None
    ) -> tuple[Case, Job | None]:
        """Take the landmarks and ask for a run; an older run's result is dropped at once.

        No job when an earlier call with the same idempotency key asked for it.
        Raises StateConflict before the scan's check went well.
        """
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if remembered(session, actor, repeatable) is not None:
                return to_value(session, row), None
            if row.status not in TAKES_LANDMARKS or not has_file(session, case_id, "examination.npz"):
                raise StateConflict(f"Landmarks cannot be placed while the case is {_words(row.status)}.")
            dropped = detach(session, case_id, but=OF_SCAN + OF_CHECK)
            row.landmarks = sealed(session, case_id, {name: list(place) for name, place in asked.landmarks.items()})
            row.unit, row.method, row.is_sent = asked.unit or row.unit, asked.method, False
            job = new_job(session, row, "locate")
            take(self._database, session, row, actor, Step("queued", "landmarks.place"))
            remember(session, actor, repeatable, row.id)
            case = to_value(session, row)
        self._vault.discard(case_id, dropped)
        return case, job

    def note_guide(self, actor: Actor, case_id: str, guide: Guide) -> Case:
        """Remember how far the family has come with the instructions for making a scan."""
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            row.guide_app, row.guide_is_read = guide.app, guide.is_read
            return to_value(session, row)

    def cancel(self, actor: Actor, case_id: str) -> tuple[Case, Job | None]:
        """Stop what is at work and step back; the job that was current, if any. A case at rest stays as it is."""
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            before = AFTER_CANCEL.get(row.status)  # type: ignore[call-overload]
            if before is None or row.job_id is None:
                raise StateConflict(f"Nothing is at work: the case is {_words(row.status)}.")
            kind: Literal["check", "locate"] = "check" if row.status == "checking" else "locate"
            stopped = Job(row.job_id, row.id, kind)
            row.job_id, row.is_sent = None, False
            take(self._database, session, row, actor, Step(before, "job.cancel"))
            return to_value(session, row), stopped

    def send_for_review(self, actor: Actor, case_id: str) -> Case:
        """Hand the result to the clinician. Sent twice, it was sent once. Raises StateConflict before there is one."""
        return self._review(actor, case_id, Step("in_review", "review.send"), came_from="done")

    def take_back(self, actor: Actor, case_id: str) -> Case:
        """Undo the sending, so that points or scan can be changed. Raises StateConflict when there is no result."""
        return self._review(actor, case_id, Step("done", "review.take_back"), came_from="in_review")

    def _review(self, actor: Actor, case_id: str, step: Step, came_from: Status) -> Case:
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if row.status == came_from:
                row.is_sent = step.status == "in_review"
                take(self._database, session, row, actor, replace(step, fraction=row.fraction))
            elif row.status != step.status:
                raise StateConflict(f"There is no result to send while the case is {_words(row.status)}.")
            return to_value(session, row)

    def standing(self, actor: Actor, case_id: str) -> Standing:
        """Since when the case is in its state, and how many cases are at work before it."""
        with self._database.reading() as session:
            row = find(session, actor, case_id)
            since = session.scalar(
                sa.select(CaseEventRow.at)
                .where(CaseEventRow.case_id == case_id, CaseEventRow.kind == "status")
                .order_by(CaseEventRow.sequence.desc())
                .limit(1)
            )
            before = sa.or_(CaseRow.stage.is_not(None), CaseRow.updated_at < row.updated_at)
            at_work = sa.and_(CaseRow.status.in_(IN_WORK), CaseRow.deleted_at.is_(None), CaseRow.id != case_id)
            ahead = session.scalar(sa.select(sa.func.count()).select_from(CaseRow).where(at_work, before))
            return Standing(since or row.updated_at, 0 if row.stage else ahead or 0)

    def events_after(self, actor: Actor, case_id: str, sequence: int, limit: int = 100) -> list[CaseEvent]:
        """What happened after the event with this number, in order."""
        query = (
            sa.select(CaseEventRow)
            .where(CaseEventRow.case_id == case_id, CaseEventRow.sequence > sequence)
            .order_by(CaseEventRow.sequence)
            .limit(limit)
        )
        with self._database.reading() as session:
            find(session, actor, case_id)
            return [
                CaseEvent(row.sequence, "status" if row.kind == "status" else "progress", row.data)
                for row in session.scalars(query)
            ]


def _new_row(actor: Actor, new: NewCase) -> CaseRow:
    moment = now()
    return CaseRow(
        id=uuid.uuid4().hex,
        tenant_id=actor.tenant_id,
        owner_session_id=actor.id if actor.kind == "family" else None,
        external_id=new.external_id,
        status="awaiting_scan",
        fraction=0.0,
        age_years=new.age_years,
        sex=new.sex,
        posture=new.posture,
        person=new.person,
        consent=None if new.consent is None else new.consent.to_json(),
        guide_is_read=False,
        is_sent=False,
        answers=dict(new.answers),
        method="lubdub",
        job_number=0,
        last_event=0,
        created_at=moment,
        updated_at=moment,
    )


def _must_take_scan(row: CaseRow) -> None:
    if stop_reason(row.answers) is not None:  # type: ignore[arg-type]
        raise StateConflict("The answers given before the scan say that no places may be shown for this person.")
    if row.status not in TAKES_SCAN:
        raise StateConflict(f"A scan cannot be taken in while the case is {_words(row.status)}.")


def _words(status: str) -> str:
    return status.replace("_", " ")
