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

SCOPES = ("cases:read", "cases:write")
TOKEN_BYTES = 32
KEY_PREFIX = "lubdub_"
"""Lets secret scanners recognise a key that was committed or posted by mistake."""
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

    def create_key(self, name: str, scopes: Sequence[str]) -> tuple[PortalKey, str]:
        """A new key for the portal called name (made when new), and its token, shown this once.

        Raises ValueError for a scope that does not exist.
        """
        unknown = sorted(set(scopes) - set(SCOPES))
        if unknown or not scopes:
            raise ValueError(f"Scopes are {' and '.join(SCOPES)}; not {', '.join(unknown) or 'none at all'}.")
        token = KEY_PREFIX + secrets.token_urlsafe(TOKEN_BYTES)
        moment = now()
        with self._database.writing() as session:
            tenant = session.scalar(sa.select(TenantRow).where(TenantRow.name == name))
            if tenant is None:
                tenant = TenantRow(id=secrets.token_hex(8), name=name, created_at=moment)
                session.add(tenant)
                session.flush()
            row = PortalKeyRow(
                id=secrets.token_hex(8),
                tenant_id=tenant.id,
                name=name,
                prefix=token[: len(KEY_PREFIX) + 6],
                token_sha256=token_sha256(token),
                scopes=sorted(set(scopes)),
                created_at=moment,
            )
            session.add(row)
            audit.append(self._database, session, SYSTEM, "key.create", None, moment, row.id)
            return _key(row), token

    def list_keys(self) -> list[PortalKey]:
        """All keys, oldest first, revoked ones too."""
        with self._database.reading() as session:
            return [_key(row) for row in session.scalars(sa.select(PortalKeyRow).order_by(PortalKeyRow.created_at))]

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
        living = sa.select(PortalKeyRow).where(
            PortalKeyRow.token_sha256 == token_sha256(token), PortalKeyRow.revoked_at.is_(None)
        )
        moment = now()
        with self._database.reading() as session:
            row = session.scalar(living)
            if row is None:
                return None
            if row.last_used_at is not None and moment - row.last_used_at < SEEN_EVERY:
                return _key(row)
        with self._database.writing() as session:
            row = session.scalar(living)
            if row is None:
                return None
            row.last_used_at = moment
            return _key(row)

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
            return None if row is None else FamilySession(row.id, token, row.expires_at)

    def end_session(self, session_id: str) -> None:
        """Make a session's cookie worthless."""
        with self._database.writing() as session:
            session.execute(
                sa.update(FamilySessionRow).where(FamilySessionRow.id == session_id).values(expires_at=now())
            )


def _key(row: PortalKeyRow) -> PortalKey:
    return PortalKey(
        id=row.id,
        tenant_id=row.tenant_id,
        name=row.name,
        prefix=row.prefix,
        scopes=tuple(row.scopes),
        created_at=row.created_at,
        last_used_at=row.last_used_at,
        revoked_at=row.revoked_at,
    )
