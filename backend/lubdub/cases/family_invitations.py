"""Asking a family for a scan: a link that a button uses up, whose case then belongs to the organisation that asked."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Sequence
from datetime import date, timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.codes import code_sha256, new_code
from lubdub.cases.database import Database
from lubdub.cases.desk_values import FamilyInvitation, Offered
from lubdub.cases.errors import LinkSpent, NotAllowed, WrongBirthDate
from lubdub.cases.files import FileVault
from lubdub.cases.models import CaseRow, TenantRow
from lubdub.cases.models_desk import FamilyInvitationRow
from lubdub.cases.values import Actor, NewCase

PURPOSE = "family"
MOST_TRIES = 5
"""Wrong dates of birth before the link is shut; whoever sent it can send a new one."""
KEPT = timedelta(days=7)
"""How long a link that ran out unused stays in the list."""


class FamilyInvitations:
    """The links of all organisations; whoever acts sees those of the own one alone."""

    def __init__(self, database: Database, vault: FileVault, lasts: timedelta) -> None:
        """Over an open database and the vault that seals dates of birth. lasts: how long a link works."""
        self._database = database
        self._vault = vault
        self._lasts = lasts

    def offer(self, actor: Actor, external_id: str | None = None, birth_date: date | None = None) -> Offered:
        """A link for a family; its code is shown this once. external_id: the organisation's own name for the case."""
        code, moment, name = new_code(), now(), secrets.token_hex(8)
        row = FamilyInvitationRow(
            id=name,
            tenant_id=actor.tenant_id,
            external_id=external_id or None,
            birth_date=None if birth_date is None else self._sealed(name, birth_date),
            tries=0,
            token_sha256=code_sha256(PURPOSE, code),
            created_at=moment,
            expires_at=moment + self._lasts,
        )
        with self._database.writing() as session:
            session.add(row)
            audit.append(self._database, session, actor, "family.invite", None, moment, name)
        return Offered(name, code, row.expires_at)

    def offer_again(self, actor: Actor, invitation_id: str) -> Offered:
        """A new link in place of the old one, which stops working; a browser that took it keeps its case until then.

        Raises NotAllowed for an invitation that is not the organisation's.
        """
        code, moment = new_code(), now()
        with self._database.writing() as session:
            row = _own(session, actor, invitation_id)
            row.token_sha256, row.tries, row.expires_at = code_sha256(PURPOSE, code), 0, moment + self._lasts
            audit.append(self._database, session, actor, "family.invite_again", row.case_id, moment, row.id)
            return Offered(row.id, code, row.expires_at)

    def revoke(self, actor: Actor, invitation_id: str) -> None:
        """The link stops working and leaves the list. A case that was opened stays. Raises NotAllowed."""
        with self._database.writing() as session:
            row = _own(session, actor, invitation_id)
            session.delete(row)
            audit.append(self._database, session, actor, "family.uninvite", row.case_id, now(), row.id)

    def get(self, actor: Actor, invitation_id: str) -> FamilyInvitation:
        """One of the organisation's. Raises NotAllowed."""
        with self._database.reading() as session:
            return _to_value(session, _own(session, actor, invitation_id))

    def list_all(self, actor: Actor) -> Sequence[FamilyInvitation]:
        """The organisation's, newest first."""
        query = (
            sa.select(FamilyInvitationRow)
            .where(FamilyInvitationRow.tenant_id == actor.tenant_id)
            .order_by(FamilyInvitationRow.created_at.desc())
        )
        with self._database.reading() as session:
            return [_to_value(session, row) for row in session.scalars(query)]

    def look(self, code: str) -> FamilyInvitation | None:
        """What the link is, if it would work now. Looking changes nothing."""
        with self._database.reading() as session:
            row = session.scalar(_open(code))
            return None if row is None else _to_value(session, row)

    def take(self, actor: Actor, code: str, birth_date: date | None) -> FamilyInvitation:
        """Use the link up for the actor's browser, which also gets the case when there is one already.

        Raises LinkSpent; WrongBirthDate, which is counted.
        """
        moment = now()
        with self._database.writing() as session:
            row = session.scalar(_open(code).with_for_update())
            if row is None:
                raise LinkSpent(PURPOSE)
            fits = self._is_birth_date(row, birth_date)
            if fits:
                row.token_sha256, row.taken_at, row.session_id = None, moment, actor.id
                case = None if row.case_id is None else session.get(CaseRow, row.case_id, with_for_update=True)
                if case is not None:
                    case.owner_session_id = actor.id
                audit.append(self._database, session, actor, "family.arrive", row.case_id, moment, row.id)
            else:
                row.tries += 1
                audit.append(self._database, session, actor, "family.wrong_birth_date", row.case_id, moment, row.id)
            taken, left = _to_value(session, row), MOST_TRIES - row.tries
        if not fits:
            raise WrongBirthDate(left)
        return taken

    def waiting_for(self, actor: Actor) -> FamilyInvitation | None:
        """The invitation whose case the actor's browser has still to open."""
        with self._database.reading() as session:
            row = session.scalar(_unopened(actor))
            return None if row is None else _to_value(session, row)

    def _sealed(self, invitation_id: str, birth_date: date) -> bytes:
        return self._vault.sealed_note(_about(invitation_id), birth_date.isoformat().encode())

    def _is_birth_date(self, row: FamilyInvitationRow, said: date | None) -> bool:
        if row.birth_date is None:
            return True
        kept = self._vault.unsealed_note(_about(row.id), row.birth_date)
        return said is not None and hmac.compare_digest(kept, said.isoformat().encode())


def belong(session: Session, row: CaseRow, actor: Actor, new: NewCase) -> None:
    """Give a family's new case to the organisation that asked for it. A made-up sample is nobody's."""
    if actor.kind != "family" or new.person == "sample":
        return
    invitation = session.scalar(_unopened(actor).with_for_update())
    if invitation is not None:
        row.tenant_id, row.external_id = invitation.tenant_id, invitation.external_id
        session.add(row)
        session.flush()
        invitation.case_id = row.id


def forget_unused(session: Session) -> None:
    """Drop links that ran out long ago without a case."""
    session.execute(
        sa.delete(FamilyInvitationRow).where(
            FamilyInvitationRow.case_id.is_(None), FamilyInvitationRow.expires_at < now() - KEPT
        )
    )


def _own(session: Session, actor: Actor, invitation_id: str) -> FamilyInvitationRow:
    row = session.get(FamilyInvitationRow, invitation_id)
    if row is None or row.tenant_id != actor.tenant_id:
        raise NotAllowed("There is no such invitation in your organisation.")
    return row


def _open(code: str) -> sa.Select[FamilyInvitationRow]:
    return sa.select(FamilyInvitationRow).where(
        FamilyInvitationRow.token_sha256 == code_sha256(PURPOSE, code),
        FamilyInvitationRow.expires_at > now(),
        FamilyInvitationRow.tries < MOST_TRIES,
    )


def _unopened(actor: Actor) -> sa.Select[FamilyInvitationRow]:
    return (
        sa.select(FamilyInvitationRow)
        .where(FamilyInvitationRow.session_id == actor.id, FamilyInvitationRow.case_id.is_(None))
        .order_by(FamilyInvitationRow.taken_at.desc())
        .limit(1)
    )


def _to_value(session: Session, row: FamilyInvitationRow) -> FamilyInvitation:
    case = None if row.case_id is None else session.get(CaseRow, row.case_id)
    return FamilyInvitation(
        id=row.id,
        tenant_id=row.tenant_id,
        organisation=session.get_one(TenantRow, row.tenant_id).name,
        external_id=row.external_id,
        asks_birth_date=row.birth_date is not None,
        is_locked=row.tries >= MOST_TRIES,
        created_at=row.created_at,
        expires_at=row.expires_at,
        taken_at=row.taken_at,
        case_id=row.case_id,
        case_status=None if case is None else case.status,  # type: ignore[arg-type]
    )


def _about(invitation_id: str) -> str:
    return f"birth date of invitation {invitation_id}"
