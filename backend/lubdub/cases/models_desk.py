"""The desk's tables: clinicians, how they sign in, their sessions, and links that let people in."""

from __future__ import annotations

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from lubdub.cases.models import Base


class ClinicianRow(Base):
    """Somebody who works at the desk of one organisation. second_factor: the sealed secret of the code app.

    login_sha256: of whom the organisation's own login means, once it has signed them in.
    """

    __tablename__ = "clinicians"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    tenant_id: Mapped[str] = mapped_column(sa.ForeignKey("tenants.id"), index=True)
    name: Mapped[str] = mapped_column(sa.String(120))
    email: Mapped[str] = mapped_column(sa.String(254), unique=True)
    role: Mapped[str] = mapped_column(sa.String(16))
    created_at: Mapped[datetime]
    disabled_at: Mapped[datetime | None]
    password_hash: Mapped[str | None] = mapped_column(sa.String(300))
    second_factor: Mapped[bytes | None]
    last_code_step: Mapped[int] = mapped_column(default=0)
    login_sha256: Mapped[str | None] = mapped_column(sa.String(64), index=True, unique=True)


class RecoveryCodeRow(Base):
    """A code that stands in once for the code app, known only by its hash."""

    __tablename__ = "recovery_codes"
    clinician_id: Mapped[str] = mapped_column(sa.ForeignKey("clinicians.id"), primary_key=True)
    code_sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)


class ClinicianSessionRow(Base):
    """A signed-in browser, known only by the hash of its cookie. how: the way of signing in."""

    __tablename__ = "clinician_sessions"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    clinician_id: Mapped[str] = mapped_column(sa.ForeignKey("clinicians.id"), index=True)
    token_sha256: Mapped[str] = mapped_column(sa.String(64), unique=True)
    how: Mapped[str] = mapped_column(sa.String(16))
    device: Mapped[str] = mapped_column(sa.String(200))
    created_at: Mapped[datetime]
    seen_at: Mapped[datetime]
    expires_at: Mapped[datetime]


class InvitationRow(Base):
    """A link that makes an account, or gives one (clinician_id) new ways to sign in, once.

    tenant_id: empty for the very first clinician, who names the organisation.
    """

    __tablename__ = "invitations"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    tenant_id: Mapped[str | None] = mapped_column(sa.ForeignKey("tenants.id"), index=True)
    clinician_id: Mapped[str | None] = mapped_column(sa.ForeignKey("clinicians.id"))
    role: Mapped[str] = mapped_column(sa.String(16))
    token_sha256: Mapped[str] = mapped_column(sa.String(64), unique=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]


class AttemptRow(Base):
    """How often something that can be guessed was tried since a moment. subject: hashed, names nobody."""

    __tablename__ = "attempts"
    subject_sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    count: Mapped[int]
    since: Mapped[datetime]


class PasskeyRow(Base):
    """A passkey's public half. sign_count: as its authenticator last said it."""

    __tablename__ = "passkeys"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    clinician_id: Mapped[str] = mapped_column(sa.ForeignKey("clinicians.id"), index=True)
    credential_id: Mapped[bytes] = mapped_column(sa.LargeBinary(1023), unique=True)
    public_key: Mapped[bytes]
    sign_count: Mapped[int] = mapped_column(sa.BigInteger)
    device: Mapped[str] = mapped_column(sa.String(200))
    created_at: Mapped[datetime]
    last_used_at: Mapped[datetime | None]


class ChallengeRow(Base):
    """What a browser is asked to sign, once and soon. browser: the hash of its cookie."""

    __tablename__ = "challenges"
    browser_sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    challenge: Mapped[bytes]
    expires_at: Mapped[datetime]


class FamilyInvitationRow(Base):
    """A link by which a clinician asks a family for a scan. birth_date: sealed, when it is to be asked.

    session_id: of the browser that took the link; case_id: of the case it then opened.
    """

    __tablename__ = "family_invitations"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    tenant_id: Mapped[str] = mapped_column(sa.ForeignKey("tenants.id"), index=True)
    external_id: Mapped[str | None] = mapped_column(sa.String(200))
    birth_date: Mapped[bytes | None]
    tries: Mapped[int] = mapped_column(default=0)
    token_sha256: Mapped[str | None] = mapped_column(sa.String(64), unique=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    taken_at: Mapped[datetime | None]
    session_id: Mapped[str | None] = mapped_column(sa.String(64), index=True)
    case_id: Mapped[str | None] = mapped_column(sa.ForeignKey("cases.id"), index=True)
