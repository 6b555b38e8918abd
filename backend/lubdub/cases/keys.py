"""What a portal does with its own keys: list, make, rotate and end them, and exchange one for a short-lived token."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import KeyNotFound, StateConflict
from lubdub.cases.models import AccessTokenRow, PortalKeyRow, TenantRow
from lubdub.cases.people import KEY_PREFIX, TOKEN_BYTES, People, key_value, new_key, token_sha256
from lubdub.cases.values import Actor, PortalKey

TOKEN_PREFIX = KEY_PREFIX + "at_"
TOKEN_LASTS = timedelta(hours=1)
KEYS_AT_MOST = 50
"""Living keys of one portal: more are made by mistake."""


@dataclass(frozen=True)
class AccessToken:
    """A token as it is shown, once. lasts_s: seconds until it ends."""

    token: str
    scopes: tuple[str, ...]
    lasts_s: int


class Keys:
    """The keys of the actor's portal. Raises KeyNotFound for those of others."""

    def __init__(self, database: Database, people: People) -> None:
        """Over an open database."""
        self._database = database
        self._people = people

    def known(self, token: str) -> PortalKey | None:
        """The living key behind a bearer token; a short-lived token's with no more than its own scopes."""
        if not token.startswith(TOKEN_PREFIX):
            return self._people.key_of(token)
        with self._database.reading() as session:
            held = session.get(AccessTokenRow, token_sha256(token))
            if held is None or held.expires_at <= now():
                return None
        key = self._people.seen(PortalKeyRow.id == held.key_id)
        return None if key is None else replace(key, scopes=tuple(held.scopes))

    def exchange(self, key_id: str, secret: str, scopes: Sequence[str]) -> AccessToken | None:
        """A short-lived token for a key's id and token (RFC 6749 section 4.4); None when they do not fit.

        scopes: a part of the key's, all when empty. Raises ValueError for one that the key does not have.
        """
        key = self._people.key_of(secret)
        if key is None or not secrets.compare_digest(key.id.encode(), key_id.encode()):
            return None
        beyond = sorted(set(scopes) - set(key.scopes))
        if beyond:
            raise ValueError(f"The key does not have the scope {beyond[0]}.")
        granted = tuple(sorted(set(scopes))) or key.scopes
        token = TOKEN_PREFIX + secrets.token_urlsafe(TOKEN_BYTES)
        with self._database.writing() as session:
            session.add(
                AccessTokenRow(
                    token_sha256=token_sha256(token),
                    key_id=key.id,
                    scopes=list(granted),
                    expires_at=now() + TOKEN_LASTS,
                )
            )
        return AccessToken(token, granted, int(TOKEN_LASTS.total_seconds()))

    def all_of(self, actor: Actor) -> list[PortalKey]:
        """Every key of the portal, oldest first, ended ones too."""
        query = (
            sa.select(PortalKeyRow, TenantRow)
            .join(TenantRow)
            .where(PortalKeyRow.tenant_id == actor.tenant_id)
            .order_by(PortalKeyRow.created_at, PortalKeyRow.id)
        )
        with self._database.reading() as session:
            return [key_value(row, tenant) for row, tenant in session.execute(query)]

    def create(self, actor: Actor, name: str, scopes: Sequence[str]) -> tuple[PortalKey, str]:
        """One more key of the portal, and its token, shown this once. Raises StateConflict when there are too many."""
        with self._database.writing() as session:
            tenant = session.get_one(TenantRow, actor.tenant_id, with_for_update=True)
            _refuse_too_many(session, tenant)
            row, token = new_key(tenant, name, scopes)
            session.add(row)
            audit.append(self._database, session, actor, "key.create", None, row.created_at, row.id)
            return key_value(row, tenant), token

    def rotate(self, actor: Actor, key_id: str, overlap: timedelta) -> tuple[PortalKey, str]:
        """A new key with the same name and scopes; the old one works on for the overlap, so that no call fails.

        Raises StateConflict when the key has ended.
        """
        with self._database.writing() as session:
            old = _own(session, actor, key_id)
            moment = now()
            if old.revoked_at is not None or (old.expires_at is not None and old.expires_at <= moment):
                raise StateConflict("This key has ended. Make a new one.")
            tenant = session.get_one(TenantRow, actor.tenant_id, with_for_update=True)
            _refuse_too_many(session, tenant)
            row, token = new_key(tenant, old.name, old.scopes)
            session.add(row)
            old.expires_at = moment + overlap if old.expires_at is None else min(old.expires_at, moment + overlap)
            audit.append(self._database, session, actor, "key.rotate", None, moment, f"{old.id} {row.id}")
            return key_value(row, tenant), token

    def revoke(self, actor: Actor, key_id: str) -> None:
        """End a key at once, and every token it was exchanged for. Done twice, it was done once."""
        with self._database.writing() as session:
            row = _own(session, actor, key_id)
            if row.revoked_at is None:
                row.revoked_at = now()
                audit.append(self._database, session, actor, "key.revoke", None, row.revoked_at, row.id)


def _own(session: Session, actor: Actor, key_id: str) -> PortalKeyRow:
    row = session.get(PortalKeyRow, key_id, with_for_update=True)
    if row is None or row.tenant_id != actor.tenant_id:
        raise KeyNotFound(key_id)
    return row


def _refuse_too_many(session: Session, tenant: TenantRow) -> None:
    living = sa.select(sa.func.count()).where(
        PortalKeyRow.tenant_id == tenant.id,
        PortalKeyRow.revoked_at.is_(None),
        sa.or_(PortalKeyRow.expires_at.is_(None), PortalKeyRow.expires_at > now()),
    )
    if (session.scalar(living) or 0) >= KEYS_AT_MOST:
        raise StateConflict(f"The portal has {KEYS_AT_MOST} living keys. Revoke those it does not need.")
