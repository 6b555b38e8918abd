"""Deletion with a receipt, and the clock that deletes by itself."""

from __future__ import annotations

from contextlib import suppress
from datetime import datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit, outbox
from lubdub.cases.attempts import LONGEST
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import CaseHeld, CaseNotFound
from lubdub.cases.family_invitations import forget_unused
from lubdub.cases.files import FileVault, detach
from lubdub.cases.models import (
    AccessTokenRow,
    CaseEventRow,
    CaseKeyRow,
    CaseRow,
    DraftRow,
    FamilySessionRow,
    IdempotencyRow,
    LinkRow,
    UploadRow,
)
from lubdub.cases.models_desk import AttemptRow, ChallengeRow, ClinicianSessionRow, FamilyInvitationRow, InvitationRow
from lubdub.cases.models_review import ReviewStepRow
from lubdub.cases.outbox import Outbox
from lubdub.cases.repeating import REMEMBERED
from lubdub.cases.rows import find
from lubdub.cases.sealed_values import seal_older
from lubdub.cases.uploads import Uploads, drop_uploads
from lubdub.cases.values import SYSTEM, Actor, Receipt


class Privacy:
    """Deletes cases. First the case's key is destroyed, so that files, copies and backups are noise; then they go."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and vault."""
        self._database = database
        self._vault = vault

    def delete(self, actor: Actor, case_id: str, action: str = "case.delete") -> Receipt:
        """Delete a case for good. Asked again, it finishes what was left and gives the same receipt.

        Raises CaseNotFound for a case that never was the actor's, CaseHeld while there is a legal hold on it.
        """
        receipt = self.receipt(actor, case_id)
        if receipt is None:
            with self._database.writing() as session:
                row = find(session, actor, case_id, to_change=True)
                if row.hold is not None:
                    raise CaseHeld
                receipt = _wipe(self._database, session, row, actor, action)
            self._database.forget_traces()
        self._vault.remove_all(case_id)
        return receipt

    def purge(self, retention_days: float) -> list[Receipt]:
        """Delete every case that was opened longer ago than that and is not held, and what else has run out."""
        with self._database.reading() as session:
            old = session.scalars(
                sa.select(CaseRow.id).where(
                    CaseRow.created_at < now() - timedelta(days=retention_days),
                    CaseRow.deleted_at.is_(None),
                    CaseRow.hold.is_(None),
                )
            ).all()
        receipts = []
        for case_id in old:
            with suppress(CaseNotFound, CaseHeld):  # another worker's clock, or a hold, came at the same moment
                receipts.append(self.delete(SYSTEM, case_id, "case.retention"))
        self._forget_expired()
        seal_older(self._database)
        Uploads(self._database, self._vault).forget_abandoned()
        Outbox(self._database, self._vault).forget_old()
        return receipts

    def receipt(self, actor: Actor, case_id: str) -> Receipt | None:
        """Of a deletion, for whom the case belonged to; None while there is nothing deleted under this id.

        Raises CaseNotFound for a deleted case that never was the actor's.
        """
        with self._database.reading() as session:
            row = session.get(CaseRow, case_id)
            if row is None or row.deleted_at is None or row.receipt_sha256 is None:
                return None
            owns = row.owner_session_id == actor.id if actor.kind == "family" else row.tenant_id == actor.tenant_id
            if actor.kind != "system" and not owns:
                raise CaseNotFound(case_id)
            return Receipt(row.id, row.deleted_at, row.receipt_sha256)

    def _forget_expired(self) -> None:
        """Links, tokens, day-old idempotency keys, counts of tries, the desk's sessions; families' answers when
        their session is over, and this itself when no case is left.
        """
        with self._database.writing() as session:
            session.execute(sa.delete(LinkRow).where(LinkRow.expires_at < now()))
            session.execute(sa.delete(AccessTokenRow).where(AccessTokenRow.expires_at < now()))
            session.execute(sa.delete(InvitationRow).where(InvitationRow.expires_at < now()))
            forget_unused(session)
            session.execute(sa.delete(ChallengeRow).where(ChallengeRow.expires_at < now()))
            session.execute(sa.delete(ClinicianSessionRow).where(ClinicianSessionRow.expires_at < now()))
            session.execute(sa.delete(AttemptRow).where(AttemptRow.since < now() - LONGEST))
            session.execute(sa.delete(IdempotencyRow).where(IdempotencyRow.created_at < now() - REMEMBERED))
            over = sa.select(FamilySessionRow.id).where(FamilySessionRow.expires_at < now())
            session.execute(sa.delete(DraftRow).where(DraftRow.session_id.in_(over)))
            has_case = sa.exists().where(CaseRow.owner_session_id == FamilySessionRow.id)
            session.execute(sa.delete(FamilySessionRow).where(FamilySessionRow.expires_at < now(), ~has_case))


def _wipe(database: Database, session: Session, row: CaseRow, actor: Actor, action: str) -> Receipt:
    """Destroy the key and everything said about the person; the id stays, so that the receipt can be shown again."""
    moment: datetime = now()
    session.execute(sa.delete(CaseKeyRow).where(CaseKeyRow.case_id == row.id))
    session.execute(sa.delete(CaseEventRow).where(CaseEventRow.case_id == row.id))
    session.execute(sa.delete(IdempotencyRow).where(IdempotencyRow.case_id == row.id))
    session.execute(sa.delete(LinkRow).where(LinkRow.case_id == row.id))
    session.execute(sa.delete(FamilyInvitationRow).where(FamilyInvitationRow.case_id == row.id))
    session.execute(sa.delete(ReviewStepRow).where(ReviewStepRow.case_id == row.id))
    detach(session, row.id)
    drop_uploads(session, UploadRow.case_id == row.id)
    row.status, row.deleted_at, row.updated_at = "deleted", moment, moment
    row.external_id = row.age_years = row.sex = row.landmarks = row.reason = row.job_id = row.stage = None
    row.posture, row.answers, row.unit, row.fraction = "", {}, None, 0.0
    row.person, row.consent, row.sharing, row.guide_app = "", None, None, None
    outbox.tell(session, row.tenant_id, row.id, row.status, moment)
    row.receipt_sha256 = audit.append(database, session, actor, action, row.id, moment)
    return Receipt(row.id, moment, row.receipt_sha256)
