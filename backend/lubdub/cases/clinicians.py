"""Every query about who works at the desk: accounts and their roles, within one organisation."""

from __future__ import annotations

import re
import secrets

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, Joining, Role
from lubdub.cases.errors import EmailTaken, NotAllowed
from lubdub.cases.models import TenantRow
from lubdub.cases.models_desk import ClinicianRow, ClinicianSessionRow
from lubdub.cases.values import FAMILIES, Actor

EMAIL = re.compile(r"[^@\s]{1,64}@[^@\s]+\.[^@\s.]+")
LONGEST_NAME, LONGEST_EMAIL = 120, 254


class Clinicians:
    """The accounts. Whoever acts sees and changes those of the own organisation alone."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def is_anybody_here(self) -> bool:
        """Whether any clinician of any organisation can sign in."""
        with self._database.reading() as session:
            return session.scalar(sa.select(ClinicianRow.id).where(ClinicianRow.disabled_at.is_(None))) is not None

    def find(self, email: str) -> Clinician | None:
        """The account under this address, disabled or not, for the person who runs the service."""
        with self._database.reading() as session:
            row = session.scalar(sa.select(ClinicianRow).where(ClinicianRow.email == plain_email(email)))
            return None if row is None else to_clinician(session, row)

    def reviewer_of(self, tenant_id: str) -> str:
        """The name of the organisation whose clinicians review this tenant's cases; empty when nobody does."""
        reviews = TenantRow.takes_families if tenant_id == FAMILIES else TenantRow.id == tenant_id
        works = sa.exists().where(ClinicianRow.tenant_id == TenantRow.id, ClinicianRow.disabled_at.is_(None))
        with self._database.reading() as session:
            return session.scalar(sa.select(TenantRow.name).where(reviews, works).limit(1)) or ""

    def list_all(self, tenant_id: str | None = None) -> list[Clinician]:
        """The accounts of one organisation, or of all, oldest first, disabled ones too."""
        query = sa.select(ClinicianRow).order_by(ClinicianRow.created_at)
        if tenant_id is not None:
            query = query.where(ClinicianRow.tenant_id == tenant_id)
        with self._database.reading() as session:
            return [to_clinician(session, row) for row in session.scalars(query)]

    def change_role(self, actor: Actor, clinician_id: str, role: Role) -> None:
        """Give somebody another role. Raises NotAllowed."""
        with self._database.writing() as session:
            row = colleague(session, actor, clinician_id)
            if role != "administrator":
                _must_leave_administrator(session, row)
            row.role = role
            audit.append(self._database, session, actor, "clinician.role", None, now(), f"{row.id} {role}")

    def disable(self, actor: Actor, clinician_id: str) -> None:
        """Shut somebody out at once; the account's signatures stay. Raises NotAllowed."""
        moment = now()
        with self._database.writing() as session:
            row = colleague(session, actor, clinician_id)
            _must_leave_administrator(session, row)
            row.disabled_at = moment
            session.execute(sa.delete(ClinicianSessionRow).where(ClinicianSessionRow.clinician_id == row.id))
            audit.append(self._database, session, actor, "clinician.disable", None, moment, row.id)

    def enable(self, actor: Actor, clinician_id: str) -> None:
        """Let somebody in again. Raises NotAllowed."""
        with self._database.writing() as session:
            row = colleague(session, actor, clinician_id)
            row.disabled_at = None
            audit.append(self._database, session, actor, "clinician.enable", None, now(), row.id)


def new_clinician(session: Session, tenant_id: str, joining: Joining, role: Role) -> ClinicianRow:
    """An account without any way to sign in yet, within the caller's transaction. Raises EmailTaken."""
    email = plain_email(joining.email)
    if session.scalar(sa.select(ClinicianRow.id).where(ClinicianRow.email == email)) is not None:
        raise EmailTaken(email)
    row = ClinicianRow(
        id=secrets.token_hex(8),
        tenant_id=tenant_id,
        name=joining.name.strip()[:LONGEST_NAME],
        email=email,
        role=role,
        created_at=now(),
        last_code_step=0,
    )
    session.add(row)
    session.flush()
    return row


def colleague(session: Session, actor: Actor, clinician_id: str) -> ClinicianRow:
    """The row of somebody in the actor's organisation, locked to be changed. Raises NotAllowed."""
    row = session.get(ClinicianRow, clinician_id, with_for_update=True)
    if row is None or (actor.kind != "system" and row.tenant_id != actor.tenant_id):
        raise NotAllowed("There is nobody of that kind in your organisation.")
    return row


def is_email(text: str) -> bool:
    """Whether it has the form of an address; only the mail itself would prove more."""
    return len(text) <= LONGEST_EMAIL and EMAIL.fullmatch(text.strip()) is not None


def plain_email(text: str) -> str:
    """As addresses are kept and compared."""
    return text.strip().casefold()


def to_clinician(session: Session, row: ClinicianRow) -> Clinician:
    """The row as the value this room hands out."""
    organisation = session.get_one(TenantRow, row.tenant_id).name
    return Clinician(
        id=row.id,
        tenant_id=row.tenant_id,
        organisation=organisation,
        name=row.name,
        email=row.email,
        role=row.role,  # type: ignore[arg-type]  # only Role words are ever written
        created_at=row.created_at,
        disabled_at=row.disabled_at,
        has_password=row.password_hash is not None,
    )


def _must_leave_administrator(session: Session, row: ClinicianRow) -> None:
    others = sa.select(ClinicianRow.id).where(
        ClinicianRow.tenant_id == row.tenant_id,
        ClinicianRow.role == "administrator",
        ClinicianRow.disabled_at.is_(None),
        ClinicianRow.id != row.id,
    )
    if row.role == "administrator" and session.scalar(others.with_for_update()) is None:
        raise NotAllowed("An organisation needs one administrator. Make somebody else one first.")
