"""A portal's webhooks as the portal sees them: addresses, secrets, and the log of what was delivered."""

from __future__ import annotations

import base64
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import DeliveryNotFound, StateConflict, WebhookNotFound
from lubdub.cases.files import FileVault
from lubdub.cases.models import TenantRow
from lubdub.cases.models_webhooks import AttemptRow, DeliveryRow, WebhookRow
from lubdub.cases.outbox import Tried, new_delivery, secret_of
from lubdub.cases.repeating import Repeatable, remember, remembered
from lubdub.cases.states import Status
from lubdub.cases.values import Actor

SECRET_BYTES = 32
SECRET_PREFIX = "whsec_"  # nosec B105 (how every secret of Standard Webhooks begins)
WEBHOOKS_AT_MOST = 20
TEST = "webhook.test"
OVERLAP = timedelta(hours=24)
"""How long an old secret signs along after a rotation."""


@dataclass(frozen=True)
class Webhook:
    """An address that is told of states. secret: only when it was just made."""

    id: str
    url: str
    statuses: tuple[Status, ...]
    is_enabled: bool
    created_at: datetime
    secret: str | None = None


@dataclass(frozen=True)
class Delivery:
    """A message and its tries, the first one first. due_at: when it is tried next, None when it is not."""

    id: str
    kind: str
    body: str
    state: Literal["waiting", "delivered", "given_up"]
    created_at: datetime
    due_at: datetime | None
    attempts: tuple[Tried, ...]


class Webhooks:
    """The webhooks of the actor's portal. Raises WebhookNotFound and DeliveryNotFound for those of others."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and the vault that seals secrets."""
        self._database = database
        self._vault = vault

    def create(
        self, actor: Actor, url: str, statuses: Sequence[Status], repeatable: Repeatable | None = None
    ) -> Webhook:
        """A new webhook with its secret; the earlier one when the same call comes again.

        url: checked by the caller. Raises StateConflict when there are too many.
        """
        with self._database.writing() as session:
            session.get_one(TenantRow, actor.tenant_id, with_for_update=True)  # one call after the other
            known = remembered(session, actor, repeatable)
            if known is not None:
                row = _own(session, actor, known)
                return replace(_value(row), secret=self._unsealed(row))
            count = sa.select(sa.func.count()).where(WebhookRow.tenant_id == actor.tenant_id)
            if (session.scalar(count) or 0) >= WEBHOOKS_AT_MOST:
                raise StateConflict(f"There are {WEBHOOKS_AT_MOST} webhooks already. Delete one first.")
            row = WebhookRow(
                id=secrets.token_hex(8),
                tenant_id=actor.tenant_id,
                url=url,
                statuses=list(dict.fromkeys(statuses)),
                is_enabled=True,
                created_at=now(),
            )
            secret = self._new_secret(row)
            session.add(row)
            remember(session, actor, repeatable, row.id)
            audit.append(self._database, session, actor, "webhook.create", None, row.created_at, row.id)
            return replace(_value(row), secret=secret)

    def all_of(self, actor: Actor) -> list[Webhook]:
        """Every webhook of the portal, oldest first."""
        query = sa.select(WebhookRow).where(WebhookRow.tenant_id == actor.tenant_id).order_by(WebhookRow.created_at)
        with self._database.reading() as session:
            return [_value(row) for row in session.scalars(query)]

    def get(self, actor: Actor, webhook_id: str) -> Webhook:
        """One of them."""
        with self._database.reading() as session:
            return _value(_own(session, actor, webhook_id))

    def change(
        self,
        actor: Actor,
        webhook_id: str,
        url: str | None = None,
        statuses: Sequence[Status] | None = None,
        is_enabled: bool | None = None,
    ) -> Webhook:
        """Change what is given. Messages that waited when it was turned off are tried when it is on again."""
        with self._database.writing() as session:
            row = _own(session, actor, webhook_id)
            row.url = row.url if url is None else url
            row.statuses = row.statuses if statuses is None else list(dict.fromkeys(statuses))
            row.is_enabled = row.is_enabled if is_enabled is None else is_enabled
            audit.append(self._database, session, actor, "webhook.change", None, now(), row.id)
            return _value(row)

    def rotate(self, actor: Actor, webhook_id: str) -> Webhook:
        """A new secret; the old one signs along for a day, so that receivers can change over."""
        with self._database.writing() as session:
            row = _own(session, actor, webhook_id)
            row.sealed_older, row.older_ends_at = row.sealed_secret, now() + OVERLAP
            secret = self._new_secret(row)
            audit.append(self._database, session, actor, "webhook.rotate", None, now(), row.id)
            return replace(_value(row), secret=secret)

    def delete(self, actor: Actor, webhook_id: str) -> None:
        """Forget the webhook, its messages and their log."""
        with self._database.writing() as session:
            row = _own(session, actor, webhook_id)
            own = sa.select(DeliveryRow.id).where(DeliveryRow.webhook_id == row.id)
            session.execute(sa.delete(AttemptRow).where(AttemptRow.delivery_id.in_(own)))
            session.execute(sa.delete(DeliveryRow).where(DeliveryRow.webhook_id == row.id))
            session.delete(row)
            audit.append(self._database, session, actor, "webhook.delete", None, now(), row.id)

    def test(self, actor: Actor, webhook_id: str) -> Delivery:
        """Send a message that tells of nothing."""
        with self._database.writing() as session:
            row = _own(session, actor, webhook_id)
            delivery = new_delivery(row.id, TEST, {}, now())
            session.add(delivery)
            return _delivery(delivery, ())

    def deliveries(self, actor: Actor, webhook_id: str, limit: int) -> list[Delivery]:
        """The newest messages to the webhook, newest first, each with all its tries."""
        with self._database.reading() as session:
            _own(session, actor, webhook_id)
            query = (
                sa.select(DeliveryRow)
                .where(DeliveryRow.webhook_id == webhook_id)
                .order_by(DeliveryRow.created_at.desc(), DeliveryRow.id)
                .limit(limit)
            )
            return [_delivery(row, _attempts(session, row.id)) for row in session.scalars(query)]

    def replay(self, actor: Actor, webhook_id: str, delivery_id: str) -> Delivery:
        """Send a message again, now, under the same id, and again for a day when it does not arrive."""
        with self._database.writing() as session:
            _own(session, actor, webhook_id)
            row = session.get(DeliveryRow, delivery_id, with_for_update=True)
            if row is None or row.webhook_id != webhook_id:
                raise DeliveryNotFound(delivery_id)
            row.due_at, row.tries, row.delivered_at = now(), 0, None
            return _delivery(row, _attempts(session, row.id))

    def _new_secret(self, row: WebhookRow) -> str:
        secret = SECRET_PREFIX + base64.b64encode(secrets.token_bytes(SECRET_BYTES)).decode()
        row.sealed_secret = self._vault.sealed_note(secret_of(row.id), secret.encode())
        return secret

    def _unsealed(self, row: WebhookRow) -> str:
        return self._vault.unsealed_note(secret_of(row.id), row.sealed_secret).decode()


def _own(session: Session, actor: Actor, webhook_id: str) -> WebhookRow:
    row = session.get(WebhookRow, webhook_id)
    if row is None or row.tenant_id != actor.tenant_id:
        raise WebhookNotFound(webhook_id)
    return row


def _attempts(session: Session, delivery_id: str) -> tuple[Tried, ...]:
    query = sa.select(AttemptRow).where(AttemptRow.delivery_id == delivery_id).order_by(AttemptRow.number)
    return tuple(Tried(row.at, row.status, row.fault, row.milliseconds) for row in session.scalars(query))


def _value(row: WebhookRow) -> Webhook:
    statuses: tuple[Status, ...] = tuple(row.statuses)  # type: ignore[arg-type]  # only Status words are ever written
    return Webhook(row.id, row.url, statuses, row.is_enabled, row.created_at)


def _delivery(row: DeliveryRow, attempts: tuple[Tried, ...]) -> Delivery:
    state: Literal["waiting", "delivered", "given_up"] = "waiting"
    if row.due_at is None:
        state = "given_up" if row.delivered_at is None else "delivered"
    return Delivery(row.id, row.kind, row.body, state, row.created_at, row.due_at, attempts)
