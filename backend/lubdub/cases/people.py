"""Every query about who asks: portals and their keys, families and their browser sessions."""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Sequence
from datetime import timedelta

import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.models import FamilySessionRow, PortalKeyRow, TenantRow
from lubdub.cases.values import SYSTEM, FamilySession, PortalKey

SCOPES = ("cases:read", "cases:write", "keys:manage", "webhooks:manage")
TOKEN_BYTES = 32
KEY_PREFIX = "lubdub_"
"""Lets secret scanners recognise a key that was committed or posted by mistake."""
SANDBOX_PREFIX = "lubdub_test_"
"""Of a key that opens made-up cases alone; scanners may be calmer about it."""
SEEN_EVERY = timedelta(minutes=1)
"""`last_used_at` is exact to a minute, so that reading does not write at every call."""


def token_sha256(token: str) -> str:
    """What is stored of a token. Tokens are 256 random bits, so a plain hash cannot be guessed back."""
    return hashlib.sha256(token.encode()).hexdigest()


class People:
    """Portals' keys and families' sessions."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def create_key(self, name: str, scopes: Sequence[str], is_sandbox: bool = False) -> tuple[PortalKey, str]:
        """A new key for the portal called name (made when new), and its token, shown this once.

        is_sandbox: for made-up cases alone, in a tenant of their own. Raises ValueError for an unknown scope.
        """
        unknown = sorted(set(scopes) - set(SCOPES))
        if unknown or not scopes:
            raise ValueError(f"Scopes are {', '.join(SCOPES)}; not {', '.join(unknown) or 'none at all'}.")
        tenant_name = f"{name} (sandbox)" if is_sandbox else name
        with self._database.writing() as session:
            tenant = session.scalar(sa.select(TenantRow).where(TenantRow.name == tenant_name))
            if tenant is None:
                tenant = TenantRow(id=secrets.token_hex(8), name=tenant_name, created_at=now(), is_sandbox=is_sandbox)
                session.add(tenant)
                session.flush()
            row, token = new_key(tenant, name, scopes)
            session.add(row)
            audit.append(self._database, session, SYSTEM, "key.create", None, row.created_at, row.id)
            return key_value(row, tenant), token

    def list_keys(self) -> list[PortalKey]:
        """All keys, oldest first, revoked ones too."""
        with self._database.reading() as session:
            query = sa.select(PortalKeyRow, TenantRow).join(TenantRow).order_by(PortalKeyRow.created_at)
            return [key_value(row, tenant) for row, tenant in session.execute(query)]

    def revoke_key(self, key_id: str) -> bool:
        """End a key for good. False when there is no such living key."""
        moment = now()
        with self._database.writing() as session:
            row = session.get(PortalKeyRow, key_id)
            if row is None or row.revoked_at is not None:
                return False
            row.revoked_at = moment
            audit.append(self._database, session, SYSTEM, "key.revoke", None, moment, row.id)
            return True

    def key_of(self, token: str) -> PortalKey | None:
        """The living key behind a bearer token, or None."""
        return self.seen(PortalKeyRow.token_sha256 == token_sha256(token))

    def seen(self, which: sa.ColumnElement[bool]) -> PortalKey | None:
        """The living key of which that is true, now noted as used; None when there is none."""
        moment = now()
        living = (
            sa.select(PortalKeyRow, TenantRow)
            .join(TenantRow)
            .where(which, PortalKeyRow.revoked_at.is_(None))
            .where(sa.or_(PortalKeyRow.expires_at.is_(None), PortalKeyRow.expires_at > moment))
        )
        with self._database.reading() as session:
            found = session.execute(living).first()
            if found is None:
                return None
            row, tenant = found
            if row.last_used_at is not None and moment - row.last_used_at < SEEN_EVERY:
                return key_value(row, tenant)
        with self._database.writing() as session:
            found = session.execute(living).first()
            if found is None:
                return None
            row, tenant = found
            row.last_used_at = moment
            return key_value(row, tenant)

    def open_session(self, hours: float) -> FamilySession:
        """A new browser session that lasts so many hours."""
        token, moment = secrets.token_urlsafe(TOKEN_BYTES), now()
        row = FamilySessionRow(
            id=secrets.token_hex(8),
            token_sha256=token_sha256(token),
            created_at=moment,
            expires_at=moment + timedelta(hours=hours),
        )
        with self._database.writing() as session:
            session.add(row)
        return FamilySession(row.id, token, row.expires_at)

    def session_of(self, token: str) -> FamilySession | None:
        """The session behind a cookie, or None when it is unknown or over."""
        query = sa.select(FamilySessionRow).where(
            FamilySessionRow.token_sha256 == token_sha256(token), FamilySessionRow.expires_at > now()
        )
        with self._database.reading() as session:
            row = session.scalar(query)
            if row is None or row.portal_id is None:
                return None if row is None else FamilySession(row.id, token, row.expires_at)
            return embedded_session(row, token, session.get_one(TenantRow, row.portal_id))

    def end_session(self, session_id: str) -> None:
        """Make a session's cookie worthless."""
        with self._database.writing() as session:
            session.execute(
                sa.update(FamilySessionRow).where(FamilySessionRow.id == session_id).values(expires_at=now())
            )


def embedded_session(row: FamilySessionRow, token: str, portal: TenantRow) -> FamilySession:
    """The session of a frame in the portal's page."""
    origins = tuple(portal.embed_origins or ())
    return FamilySession(row.id, token, row.expires_at, origins, is_embedded=True, is_sandbox=portal.is_sandbox)


def new_key(tenant: TenantRow, name: str, scopes: Sequence[str]) -> tuple[PortalKeyRow, str]:
    """The row of a new key of the tenant, and its token."""
    prefix = SANDBOX_PREFIX if tenant.is_sandbox else KEY_PREFIX
    token = prefix + secrets.token_urlsafe(TOKEN_BYTES)
    row = PortalKeyRow(
        id=secrets.token_hex(8),
        tenant_id=tenant.id,
        name=name,
        prefix=token[: len(prefix) + 6],
        token_sha256=token_sha256(token),
        scopes=sorted(set(scopes)),
        created_at=now(),
    )
    return row, token


def key_value(row: PortalKeyRow, tenant: TenantRow) -> PortalKey:
    """The row as the value this room hands out."""
    return PortalKey(
        id=row.id,
        tenant_id=row.tenant_id,
        name=row.name,
        prefix=row.prefix,
        scopes=tuple(row.scopes),
        created_at=row.created_at,
        last_used_at=row.last_used_at,
        revoked_at=row.revoked_at,
        expires_at=row.expires_at,
        is_sandbox=tenant.is_sandbox,
    )
