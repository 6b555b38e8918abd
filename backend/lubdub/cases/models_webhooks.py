"""The tables of webhooks: where portals want to be told, what is to be told, and how it went."""

from __future__ import annotations

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from lubdub.cases.models import Base


class WebhookRow(Base):
    """An address of a portal. sealed_secret: signs what is sent there; an older one signs along until it ends."""

    __tablename__ = "webhooks"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    tenant_id: Mapped[str] = mapped_column(sa.ForeignKey("tenants.id"), index=True)
    url: Mapped[str] = mapped_column(sa.String(2000))
    statuses: Mapped[list[str]]
    is_enabled: Mapped[bool]
    sealed_secret: Mapped[bytes]
    sealed_older: Mapped[bytes | None]
    older_ends_at: Mapped[datetime | None]
    created_at: Mapped[datetime]


class DeliveryRow(Base):
    """One message to one webhook. due_at: when it is tried next; None when it arrived or was given up."""

    __tablename__ = "webhook_deliveries"
    id: Mapped[str] = mapped_column(sa.String(64), primary_key=True)
    webhook_id: Mapped[str] = mapped_column(sa.ForeignKey("webhooks.id"), index=True)
    kind: Mapped[str] = mapped_column(sa.String(64))
    body: Mapped[str] = mapped_column(sa.String(1000))
    created_at: Mapped[datetime] = mapped_column(index=True)
    due_at: Mapped[datetime | None] = mapped_column(index=True)
    tries: Mapped[int] = mapped_column(default=0)
    delivered_at: Mapped[datetime | None]


class AttemptRow(Base):
    """One try. status: of HTTP, None when there was no answer; fault: why not, in one sentence."""

    __tablename__ = "webhook_attempts"
    delivery_id: Mapped[str] = mapped_column(sa.ForeignKey("webhook_deliveries.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime]
    status: Mapped[int | None]
    fault: Mapped[str | None] = mapped_column(sa.String(200))
    milliseconds: Mapped[int]
