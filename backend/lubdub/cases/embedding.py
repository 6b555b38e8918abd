"""Cases inside a portal's own pages: which pages may frame ours, and links that open a case there once."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import FrameLinkSpent, StateConflict
from lubdub.cases.files import FileVault
from lubdub.cases.models import CaseRow, FamilySessionRow, LinkRow, TenantRow
from lubdub.cases.people import TOKEN_BYTES, embedded_session, token_sha256
from lubdub.cases.rows import find, to_value
from lubdub.cases.states import HAS_RESULT
from lubdub.cases.values import Actor, Case, FamilySession

Shows = Literal["result", "journey"]
PURPOSES: dict[Shows, str] = {"result": "embed result", "journey": "embed journey"}
LASTS = timedelta(minutes=5)
SESSION_LASTS = timedelta(hours=12)


@dataclass(frozen=True)
class EmbedLink:
    """A link as it is shown, once."""

    token: str
    expires_at: datetime


@dataclass(frozen=True)
class Embedded:
    """What a link opened. actor: who looks at a result; session: who goes the journey, None for a result alone."""

    case: Case
    actor: Actor
    origins: tuple[str, ...]
    session: FamilySession | None


class Embedding:
    """The portal's side, and the link's.

    A link's token names its organisation and its end and is signed over both: one that was made up, changed or is too
    old is turned away before the database is asked. That it works once, and for which case, the database knows.
    """

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and vault."""
        self._database, self._vault = database, vault

    def origins(self, actor: Actor) -> tuple[str, ...]:
        """The origins whose pages may frame the portal's cases."""
        with self._database.reading() as session:
            return tuple(session.get_one(TenantRow, actor.tenant_id).embed_origins or ())

    def set_origins(self, actor: Actor, origins: Sequence[str]) -> tuple[str, ...]:
        """Only these from now on. The caller has checked their form."""
        with self._database.writing() as session:
            tenant = session.get_one(TenantRow, actor.tenant_id, with_for_update=True)
            tenant.embed_origins = list(dict.fromkeys(origins))
            audit.append(self._database, session, actor, "embedding.origins", None, now())
            return tuple(tenant.embed_origins)

    def offer(self, actor: Actor, case_id: str, shows: Shows) -> EmbedLink:
        """A link that works once and soon; one that was offered before for the same stops working.

        Raises CaseNotFound, and StateConflict without origins, or for a result that is not there yet.
        """
        moment = now()
        token = self._signed(actor.tenant_id, moment + LASTS)
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if not session.get_one(TenantRow, row.tenant_id).embed_origins:
                raise StateConflict("Say first which of your pages may frame the case, by PUT /embedding.")
            if shows == "result" and row.status not in HAS_RESULT:
                raise StateConflict(f"There is no result while the case is {row.status.replace('_', ' ')}.")
            before = sa.and_(LinkRow.case_id == case_id, LinkRow.purpose == PURPOSES[shows])
            session.execute(sa.delete(LinkRow).where(before))
            session.add(
                LinkRow(
                    id=secrets.token_hex(8),
                    purpose=PURPOSES[shows],
                    case_id=case_id,
                    token_sha256=token_sha256(token),
                    expires_at=moment + LASTS,
                )
            )
            audit.append(self._database, session, actor, "embed.offer", case_id, moment, shows)
        return EmbedLink(token, moment + LASTS)

    def take(self, token: str) -> Embedded:
        """Open the link's case: for a journey in a new session, which alone has the case from now on.

        Raises FrameLinkSpent.
        """
        moment = now()
        tenant, until = self._signed_words(token)
        if until <= moment.timestamp():
            with self._database.reading() as session:
                raise FrameLinkSpent(_origins_of(session, tenant))
        query = sa.select(LinkRow).where(
            LinkRow.token_sha256 == token_sha256(token),
            LinkRow.purpose.in_(PURPOSES.values()),
            LinkRow.used_at.is_(None),
            LinkRow.expires_at > moment,
        )
        with self._database.writing() as session:
            link = session.scalar(query.with_for_update())
            row = None if link is None else session.get(CaseRow, link.case_id, with_for_update=True)
            if link is None or row is None or row.deleted_at is not None or row.tenant_id != tenant:
                raise FrameLinkSpent(_origins_of(session, tenant))
            link.used_at = moment
            portal = session.get_one(TenantRow, row.tenant_id)
            opened = None
            actor = Actor("key", f"link {link.id}", row.tenant_id)
            if link.purpose == PURPOSES["journey"]:
                opened = _new_session(session, portal, moment)
                row.owner_session_id = opened.id
                actor = opened.actor
            audit.append(self._database, session, actor, "embed.take", row.id, moment)
            return Embedded(to_value(session, row), actor, tuple(portal.embed_origins or ()), opened)

    def _signed(self, tenant: str, until: datetime) -> str:
        words = f"{tenant}.{int(until.timestamp())}.{secrets.token_urlsafe(TOKEN_BYTES)}"
        return f"{words}.{self._vault.signature(words)}"

    def _signed_words(self, token: str) -> tuple[str, int]:
        """The organisation whose link it is, and until when it works. Raises FrameLinkSpent for an unsigned token."""
        words, _, signed = token.rpartition(".")
        if not hmac.compare_digest(signed.encode(), self._vault.signature(words).encode()):
            raise FrameLinkSpent(())
        tenant, until, _ = words.split(".")
        return tenant, int(until)


def _origins_of(session: Session, tenant_id: str) -> tuple[str, ...]:
    """Whose pages may frame the organisation's cases; none when it is gone."""
    tenant = session.get(TenantRow, tenant_id)
    return () if tenant is None else tuple(tenant.embed_origins or ())


def _new_session(session: Session, portal: TenantRow, moment: datetime) -> FamilySession:
    token = secrets.token_urlsafe(TOKEN_BYTES)
    row = FamilySessionRow(
        id=secrets.token_hex(8),
        token_sha256=token_sha256(token),
        created_at=moment,
        expires_at=moment + SESSION_LASTS,
        portal_id=portal.id,
    )
    session.add(row)
    session.flush()
    return embedded_session(row, token, portal)
