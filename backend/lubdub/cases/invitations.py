"""Links that make accounts at the desk: they work once, for a time, and only their hashes are kept."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clinicians import colleague, new_clinician, to_clinician
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, Invitation, Joining, Offered, Role
from lubdub.cases.errors import LinkSpent, NotAllowed
from lubdub.cases.models import TenantRow
from lubdub.cases.models_desk import (
    ClinicianRow,
    ClinicianSessionRow,
    InvitationRow,
    PasskeyRow,
    RecoveryCodeRow,
)
from lubdub.cases.people import TOKEN_BYTES, token_sha256
from lubdub.cases.values import SYSTEM, Actor

FIRST_LASTS = timedelta(hours=24)
LASTS = timedelta(days=7)
RENEWAL_LASTS = timedelta(hours=24)

Equip = Callable[[Session, ClinicianRow], None]
"""Gives a new account its way to sign in; made by `credentials` and `passkeys`."""


class Invitations:
    """Links for the first clinician and for colleagues."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def offer_first(self) -> Offered | None:
        """The link for the very first clinician, in place of an earlier one; None when somebody is here already."""
        moment = now()
        with self._database.writing() as session:
            if session.scalar(sa.select(ClinicianRow.id).limit(1)) is not None:
                return None
            session.execute(sa.delete(InvitationRow).where(InvitationRow.tenant_id.is_(None)))
            offered = _add(session, None, "administrator", FIRST_LASTS)
            audit.append(self._database, session, SYSTEM, "desk.first_link", None, moment, offered.id)
            return offered

    def offer(self, actor: Actor, role: Role) -> Offered:
        """A link for a colleague in the actor's organisation."""
        with self._database.writing() as session:
            offered = _add(session, actor.tenant_id, role, LASTS)
            audit.append(self._database, session, actor, "clinician.invite", None, now(), f"{offered.id} {role}")
            return offered

    def offer_renewal(self, actor: Actor, clinician_id: str) -> Offered:
        """A link by which a colleague who lost phone or passkeys gets new ways to sign in. Raises NotAllowed."""
        with self._database.writing() as session:
            row = colleague(session, actor, clinician_id)
            offered = _add(session, row.tenant_id, row.role, RENEWAL_LASTS, row.id)  # type: ignore[arg-type]
            audit.append(self._database, session, actor, "clinician.renew", None, now(), f"{offered.id} {row.id}")
            return offered

    def list_open(self, tenant_id: str) -> list[Invitation]:
        """The organisation's links that would work now, newest first."""
        query = (
            sa.select(InvitationRow)
            .where(InvitationRow.tenant_id == tenant_id, InvitationRow.expires_at > now())
            .order_by(InvitationRow.created_at.desc())
        )
        with self._database.reading() as session:
            return [_to_value(session, row) for row in session.scalars(query)]

    def revoke(self, actor: Actor, invitation_id: str) -> bool:
        """End a link of the own organisation. False when there is no such open link."""
        with self._database.writing() as session:
            row = session.get(InvitationRow, invitation_id)
            if row is None or row.tenant_id != actor.tenant_id:
                return False
            session.delete(row)
            audit.append(self._database, session, actor, "clinician.uninvite", None, now(), invitation_id)
            return True

    def look(self, token: str) -> Invitation | None:
        """What the link is, if it would work now. Looking changes nothing."""
        with self._database.reading() as session:
            row = session.scalar(_open(token))
            return None if row is None else _to_value(session, row)

    def accept(self, token: str, joining: Joining, equip: Equip) -> Clinician:
        """Make the account, with its way to sign in, and use the link up: all of it or nothing.

        Raises LinkSpent, EmailTaken, NotAllowed.
        """
        with self._database.writing() as session:
            link = session.scalar(_open(token).with_for_update())
            if link is None:
                raise LinkSpent("invitation")
            if link.clinician_id is not None:
                return self._renew(session, link, link.clinician_id, equip)
            tenant_id = link.tenant_id or _new_organisation(session, joining.organisation)
            row = new_clinician(session, tenant_id, joining, link.role)  # type: ignore[arg-type]
            equip(session, row)
            session.delete(link)
            actor = Actor("clinician", row.id, tenant_id)
            audit.append(self._database, session, actor, "clinician.join", None, now(), f"{link.id} {row.role}")
            return to_clinician(session, row)

    def _renew(self, session: Session, link: InvitationRow, clinician_id: str, equip: Equip) -> Clinician:
        """New ways to sign in instead of the old ones; every open session ends."""
        row = session.get_one(ClinicianRow, clinician_id, with_for_update=True)
        if row.disabled_at is not None:
            raise LinkSpent("invitation")
        session.execute(sa.delete(PasskeyRow).where(PasskeyRow.clinician_id == row.id))
        session.execute(sa.delete(RecoveryCodeRow).where(RecoveryCodeRow.clinician_id == row.id))
        session.execute(sa.delete(ClinicianSessionRow).where(ClinicianSessionRow.clinician_id == row.id))
        row.password_hash = row.second_factor = row.login_sha256 = None
        equip(session, row)
        session.delete(link)
        renewed = to_clinician(session, row)
        audit.append(self._database, session, renewed.actor, "clinician.renewed", None, now(), link.id)
        return renewed


def _add(
    session: Session, tenant_id: str | None, role: Role, lasts: timedelta, clinician_id: str | None = None
) -> Offered:
    token, moment = secrets.token_urlsafe(TOKEN_BYTES), now()
    row = InvitationRow(
        id=secrets.token_hex(8),
        tenant_id=tenant_id,
        clinician_id=clinician_id,
        role=role,
        token_sha256=token_sha256(token),
        created_at=moment,
        expires_at=moment + lasts,
    )
    session.add(row)
    session.flush()
    return Offered(row.id, token, row.expires_at)


def _open(token: str) -> sa.Select[InvitationRow]:
    return sa.select(InvitationRow).where(
        InvitationRow.token_sha256 == token_sha256(token), InvitationRow.expires_at > now()
    )


def _to_value(session: Session, row: InvitationRow) -> Invitation:
    tenant = None if row.tenant_id is None else session.get(TenantRow, row.tenant_id)
    renewed = None if row.clinician_id is None else session.get(ClinicianRow, row.clinician_id)
    return Invitation(
        id=row.id,
        organisation="" if tenant is None else tenant.name,
        role=row.role,  # type: ignore[arg-type]
        email="" if renewed is None else renewed.email,
        created_at=row.created_at,
        expires_at=row.expires_at,
    )


def _new_organisation(session: Session, name: str) -> str:
    """The very first clinician's: it also takes the families that come without an invitation.

    A portal of the same name is the same organisation.
    """
    name = name.strip()[:200]
    known = session.scalar(sa.select(TenantRow).where(TenantRow.name == name))
    if known is not None and known.id == "families":
        raise NotAllowed("Please choose another name for your organisation.")
    tenant = known or TenantRow(id=secrets.token_hex(8), name=name, created_at=now())
    tenant.takes_families = True
    session.add(tenant)
    session.flush()
    return tenant.id
