"""The tables. Only this room reads or writes them; what they hold leaves as the values of `values.py`."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class UtcTime(sa.TypeDecorator[datetime]):
    """A moment in UTC; SQLite forgets time zones, so they are taken off and put back here."""

    impl = sa.DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        """Into the database: naive UTC."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        """Out of the database: aware UTC."""
        return None if value is None else value.replace(tzinfo=UTC)


class Base(DeclarativeBase):
    """All tables of the service."""

    type_annotation_map = {  # noqa: RUF012 (SQLAlchemy reads a plain dict)
        datetime: UtcTime,
        dict[str, Any]: sa.JSON(none_as_null=True),
        list[str]: sa.JSON(none_as_null=True),
    }


class TenantRow(Base):
    """An organisation with its portals and clinicians, or `families` for everybody without one.

    takes_families: whether its clinicians see what families of no organisation send for review.
    """

    __tablename__ = "tenants"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    name: Mapped[str] = mapped_column(sa.String(200), unique=True)
    created_at: Mapped[datetime]
    is_sandbox: Mapped[bool] = mapped_column(server_default=sa.false())
    takes_families: Mapped[bool] = mapped_column(server_default=sa.false())
    embed_origins: Mapped[list[str] | None] = mapped_column(sa.JSON(none_as_null=True))


class PortalKeyRow(Base):
    """A bearer key, known only by its hash."""

    __tablename__ = "portal_keys"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    tenant_id: Mapped[str] = mapped_column(sa.ForeignKey("tenants.id"))
    name: Mapped[str] = mapped_column(sa.String(200))
    prefix: Mapped[str] = mapped_column(sa.String(32))
    token_sha256: Mapped[str] = mapped_column(sa.String(64), unique=True)
    scopes: Mapped[list[str]]
    created_at: Mapped[datetime]
    last_used_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]
    expires_at: Mapped[datetime | None]


class AccessTokenRow(Base):
    """A short-lived token that a key was exchanged for, known only by its hash; it ends with its key."""

    __tablename__ = "access_tokens"
    token_sha256: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    key_id: Mapped[str] = mapped_column(sa.ForeignKey("portal_keys.id"))
    scopes: Mapped[list[str]]
    expires_at: Mapped[datetime]


class DraftRow(Base):
    """What a family has answered before there is a case, sealed under a key of the session's own."""

    __tablename__ = "drafts"
    session_id: Mapped[str] = mapped_column(sa.ForeignKey("family_sessions.id"), primary_key=True)
    sealed: Mapped[bytes]
    updated_at: Mapped[datetime]


class FamilySessionRow(Base):
    """A browser's session, known only by the hash of its cookie. portal_id: in whose page it lives, if in any."""

    __tablename__ = "family_sessions"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    token_sha256: Mapped[str] = mapped_column(sa.String(64), unique=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    portal_id: Mapped[str | None] = mapped_column(sa.ForeignKey("tenants.id"))


class CaseRow(Base):
    """The truth about a case. A deleted one keeps its id, its tenant and its receipt, nothing about the person.

    is_sent: whether it was handed to the clinicians, and neither taken back nor changed by the family since. sharing:
    the separate yes to keeping the shape as a reference body. hold: who keeps the case from being deleted, and why.
    job_starts: how often workers took the job up; job_turn: its place in the fair order, see `turns`.
    """

    __tablename__ = "cases"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    tenant_id: Mapped[str] = mapped_column(sa.ForeignKey("tenants.id"), index=True)
    owner_session_id: Mapped[str | None] = mapped_column(sa.ForeignKey("family_sessions.id"), index=True)
    external_id: Mapped[str | None] = mapped_column(sa.String(200))
    status: Mapped[str] = mapped_column(sa.String(32), index=True)
    age_years: Mapped[float | None]
    sex: Mapped[str | None] = mapped_column(sa.String(16))
    posture: Mapped[str] = mapped_column(sa.String(16))
    answers: Mapped[dict[str, Any]]
    unit: Mapped[str | None] = mapped_column(sa.String(8))
    method: Mapped[str] = mapped_column(sa.String(16))
    landmarks: Mapped[dict[str, Any] | None]
    job_id: Mapped[str | None] = mapped_column(sa.String(128))
    job_number: Mapped[int] = mapped_column(default=0)
    job_starts: Mapped[int] = mapped_column(default=0, server_default="0")
    job_turn: Mapped[int] = mapped_column(default=1, server_default="1")
    stage: Mapped[str | None] = mapped_column(sa.String(32))
    fraction: Mapped[float] = mapped_column(default=0.0)
    reason: Mapped[dict[str, Any] | None]
    last_event: Mapped[int] = mapped_column(default=0)
    created_at: Mapped[datetime]
    updated_at: Mapped[datetime]
    deleted_at: Mapped[datetime | None]
    receipt_sha256: Mapped[str | None] = mapped_column(sa.String(64))
    person: Mapped[str] = mapped_column(sa.String(16), server_default="child")
    consent: Mapped[dict[str, Any] | None]
    guide_app: Mapped[str | None] = mapped_column(sa.String(32))
    guide_is_read: Mapped[bool] = mapped_column(server_default=sa.false())
    is_sent: Mapped[bool] = mapped_column(server_default=sa.false())
    sharing: Mapped[dict[str, Any] | None]
    hold: Mapped[dict[str, Any] | None]


class CaseEventRow(Base):
    """What a page or portal that listens is told, in order."""

    __tablename__ = "case_events"
    case_id: Mapped[str] = mapped_column(sa.ForeignKey("cases.id"), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    kind: Mapped[str] = mapped_column(sa.String(16))
    data: Mapped[dict[str, Any]]
    at: Mapped[datetime]


class IdempotencyRow(Base):
    """A call that must not happen twice: the caller's key, the call it came with, and what it made or changed."""

    __tablename__ = "idempotency_keys"
    owner: Mapped[str] = mapped_column(sa.String(140), primary_key=True)
    key: Mapped[str] = mapped_column(sa.String(200), primary_key=True)
    body_sha256: Mapped[str] = mapped_column(sa.String(64))
    case_id: Mapped[str] = mapped_column(sa.String(64))
    created_at: Mapped[datetime]


class AuditRow(Base):
    """Who did what to which case, when: append only, each line sealed onto the one before it."""

    __tablename__ = "audit"
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime]
    actor: Mapped[str] = mapped_column(sa.String(140))
    action: Mapped[str] = mapped_column(sa.String(64))
    case_id: Mapped[str | None] = mapped_column(sa.String(64), index=True)
    detail: Mapped[str] = mapped_column(sa.String(200))
    previous_sha256: Mapped[str] = mapped_column(sa.String(64))
    sha256: Mapped[str] = mapped_column(sa.String(64))


class CaseKeyRow(Base):
    """A case's data key, sealed under the master key. Without this row the case's files are noise."""

    __tablename__ = "case_keys"
    case_id: Mapped[str] = mapped_column(sa.ForeignKey("cases.id"), primary_key=True)
    wrapped_key: Mapped[bytes]
    created_at: Mapped[datetime]


class FileRow(Base):
    """Where an artefact of a case lies. object_key: random, says nothing."""

    __tablename__ = "files"
    case_id: Mapped[str] = mapped_column(sa.ForeignKey("cases.id"), primary_key=True)
    artefact: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    object_key: Mapped[str] = mapped_column(sa.String(64), unique=True)
    size: Mapped[int] = mapped_column(sa.BigInteger)
    created_at: Mapped[datetime]


class ServiceKeyRow(Base):
    """A key of the service's own, sealed under the master key; named by what it seals."""

    __tablename__ = "service_keys"
    name: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    wrapped_key: Mapped[bytes]


class UploadRow(Base):
    """A scan on its way in, piece by piece, until `length` bytes are there."""

    __tablename__ = "uploads"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    case_id: Mapped[str] = mapped_column(sa.ForeignKey("cases.id"), index=True)
    length: Mapped[int] = mapped_column(sa.BigInteger)
    unit: Mapped[str | None] = mapped_column(sa.String(8))
    expires_at: Mapped[datetime]


class UploadPartRow(Base):
    """One piece that arrived: where it begins in the file, and the sealed object that holds it."""

    __tablename__ = "upload_parts"
    upload_id: Mapped[str] = mapped_column(sa.ForeignKey("uploads.id"), primary_key=True)
    start: Mapped[int] = mapped_column(sa.BigInteger, primary_key=True, autoincrement=False)
    object_key: Mapped[str] = mapped_column(sa.String(64), unique=True)
    size: Mapped[int] = mapped_column(sa.BigInteger)


class LinkRow(Base):
    """A link that works once, known only by the hash of its secret. purpose: what it is for, such as `handoff`."""

    __tablename__ = "links"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    purpose: Mapped[str] = mapped_column(sa.String(16))
    case_id: Mapped[str] = mapped_column(sa.ForeignKey("cases.id"), index=True)
    token_sha256: Mapped[str] = mapped_column(sa.String(64), unique=True)
    expires_at: Mapped[datetime]
    used_at: Mapped[datetime | None]


class WorkerRow(Base):
    """When a worker was last seen alive. sandbox: what holds for the processes in which it reads files."""

    __tablename__ = "workers"
    name: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    solver: Mapped[str] = mapped_column(sa.String(32))
    seen_at: Mapped[datetime]
    sandbox: Mapped[dict[str, Any] | None] = mapped_column(sa.JSON(none_as_null=True))
