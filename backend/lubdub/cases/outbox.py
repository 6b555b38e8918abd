"""Messages to portals on their way out: written together with what they tell of, tried until they arrive."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from datetime import datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.models_webhooks import AttemptRow, DeliveryRow, WebhookRow

WAITS = tuple(timedelta(seconds=seconds) for seconds in (5, 30, 120, 600, 1800, 3600, 7200, 14_400, 28_800, 28_800))
"""How long to wait after each try that failed: about a day together. Then the message is given up."""
LEASE = timedelta(minutes=2)
"""How long a worker may take for one try; after that another one takes the message up."""
KEPT = timedelta(days=30)
"""How long the log is kept."""
GONE = 410
"""The answer of a receiver that wants nothing more, ever (Standard Webhooks)."""


@dataclass(frozen=True)
class Message:
    """A message to be tried now. secrets: the current one first; number: of this try, from 1."""

    id: str
    url: str
    body: str
    secrets: tuple[str, ...]
    number: int


@dataclass(frozen=True)
class Tried:
    """How a try went. status: of HTTP, None without an answer; fault: one sentence, None when it arrived."""

    at: datetime
    status: int | None
    fault: str | None
    milliseconds: int

    @property
    def has_arrived(self) -> bool:
        """Whether the receiver took it."""
        return self.fault is None


def tell(session: Session, tenant_id: str, case_id: str, status: str, moment: datetime) -> None:
    """Write, inside the transaction of the change, a message to each webhook of the tenant that wants to know.

    It says which case and which state: nothing about a person.
    """
    query = sa.select(WebhookRow).where(WebhookRow.tenant_id == tenant_id, WebhookRow.is_enabled)
    for webhook in session.scalars(query):
        if status in webhook.statuses:
            session.add(new_delivery(webhook.id, f"case.{status}", {"id": case_id, "status": status}, moment))


def new_delivery(webhook_id: str, kind: str, data: dict[str, str], moment: datetime) -> DeliveryRow:
    """A message that is due at once."""
    body = json.dumps({"type": kind, "timestamp": moment.isoformat(), "data": data})
    return DeliveryRow(
        id=f"msg_{secrets.token_hex(16)}",
        webhook_id=webhook_id,
        kind=kind,
        body=body,
        created_at=moment,
        due_at=moment,
        tries=0,
    )


def secret_of(webhook_id: str) -> str:
    """What a sealed secret is about."""
    return f"secret of webhook {webhook_id}"


class Outbox:
    """The messages as the worker that sends them sees them."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and the vault that unseals secrets."""
        self._database = database
        self._vault = vault

    def take(self) -> Message | None:
        """The message that has been due longest, kept from other workers for the lease; None when none is due."""
        moment = now()
        query = (
            sa.select(DeliveryRow, WebhookRow)
            .join(WebhookRow, WebhookRow.id == DeliveryRow.webhook_id)
            .where(DeliveryRow.due_at <= moment, WebhookRow.is_enabled)
            .order_by(DeliveryRow.due_at)
            .limit(1)
        )
        with self._database.reading() as session:
            if session.execute(query).first() is None:
                return None
        with self._database.writing() as session:
            found = session.execute(query.with_for_update(of=DeliveryRow, skip_locked=True)).first()
            if found is None:
                return None
            delivery, webhook = found
            delivery.due_at = moment + LEASE
            delivery.tries += 1
            return Message(delivery.id, webhook.url, delivery.body, self._secrets(webhook, moment), delivery.tries)

    def note(self, message: Message, tried: Tried) -> None:
        """Write down how the try went, and when the next one is due. A receiver that is gone is not told again."""
        with self._database.writing() as session:
            delivery = session.get(DeliveryRow, message.id, with_for_update=True)
            if delivery is None:
                return  # the webhook was deleted meanwhile
            logged = sa.select(sa.func.count()).where(AttemptRow.delivery_id == delivery.id)
            session.add(
                AttemptRow(
                    delivery_id=delivery.id,
                    number=(session.scalar(logged) or 0) + 1,
                    at=tried.at,
                    status=tried.status,
                    fault=tried.fault,
                    milliseconds=tried.milliseconds,
                )
            )
            if tried.has_arrived:
                delivery.due_at, delivery.delivered_at = None, tried.at
            else:
                delivery.due_at = now() + WAITS[message.number - 1] if message.number <= len(WAITS) else None
            if tried.status == GONE:
                delivery.due_at = None
                session.get_one(WebhookRow, delivery.webhook_id).is_enabled = False

    def forget_old(self) -> None:
        """Drop what is older than the log is kept."""
        old = sa.select(DeliveryRow.id).where(DeliveryRow.created_at < now() - KEPT)
        with self._database.writing() as session:
            session.execute(sa.delete(AttemptRow).where(AttemptRow.delivery_id.in_(old)))
            session.execute(sa.delete(DeliveryRow).where(DeliveryRow.created_at < now() - KEPT))

    def _secrets(self, webhook: WebhookRow, moment: datetime) -> tuple[str, ...]:
        sealed = [webhook.sealed_secret]
        if webhook.sealed_older is not None and webhook.older_ends_at is not None and webhook.older_ends_at > moment:
            sealed.append(webhook.sealed_older)
        return tuple(self._vault.unsealed_note(secret_of(webhook.id), one).decode() for one in sealed)
