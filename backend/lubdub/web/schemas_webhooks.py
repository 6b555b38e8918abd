"""The shapes of webhooks in REST."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from lubdub.cases.states import Status
from lubdub.cases.webhooks import Delivery, Webhook
from lubdub.web.schemas import Strict

WORTH_TELLING: tuple[Status, ...] = (
    "awaiting_landmarks",
    "done",
    "in_review",
    "reviewed",
    "returned",
    "unusable",
    "refused",
    "failed",
    "deleted",
)
Url = Annotated[
    str, Field(max_length=2000, description="https, on the public internet.", examples=["https://p.example"])
]
Statuses = Annotated[list[Status], Field(min_length=1, max_length=20, description="States to be told of.")]


class WebhookIn(Strict):
    """A new webhook."""

    url: Url
    statuses: Statuses = Field(default_factory=lambda: list(WORTH_TELLING))


class WebhookChangeIn(Strict):
    """What is to be changed; what is not given stays."""

    url: Url | None = None
    statuses: Statuses | None = None
    enabled: bool | None = None


class WebhookOut(BaseModel):
    """A webhook."""

    id: str
    url: str
    statuses: list[Status]
    enabled: bool = Field(description="Off when you turned it off, or when the receiver answered 410.")
    created_at: datetime

    @classmethod
    def of(cls, webhook: Webhook) -> WebhookOut:
        """From the store's value."""
        return cls.model_validate(_told(webhook))


class NewWebhookOut(WebhookOut):
    """A webhook with its new secret."""

    secret: str = Field(description="For your Standard Webhooks library; begins with `whsec_`. Keep it.")

    @classmethod
    def with_secret(cls, webhook: Webhook) -> NewWebhookOut:
        """From the store's value, which has its secret."""
        return cls.model_validate(_told(webhook) | {"secret": webhook.secret})


class WebhooksOut(BaseModel):
    """All webhooks of a portal."""

    items: list[WebhookOut]


class AttemptOut(BaseModel):
    """One try."""

    at: datetime
    status: int | None = Field(description="The answer's; null when there was none.")
    fault: str | None = Field(description="Why it did not arrive.")
    milliseconds: int


class DeliveryOut(BaseModel):
    """A message and how it went."""

    id: str = Field(description="Also the header `webhook-id`, the same at every try.")
    type: str = Field(description="`case.` and the state, or `webhook.test`.")
    body: str = Field(description="As it is sent and signed.")
    state: Literal["waiting", "delivered", "given_up"]
    created_at: datetime
    due_at: datetime | None = Field(description="When it is tried next.")
    attempts: list[AttemptOut]

    @staticmethod
    def of(delivery: Delivery) -> DeliveryOut:
        """From the store's value."""
        return DeliveryOut(
            id=delivery.id,
            type=delivery.kind,
            body=delivery.body,
            state=delivery.state,
            created_at=delivery.created_at,
            due_at=delivery.due_at,
            attempts=[
                AttemptOut(at=one.at, status=one.status, fault=one.fault, milliseconds=one.milliseconds)
                for one in delivery.attempts
            ],
        )


class DeliveriesOut(BaseModel):
    """The newest messages, newest first."""

    items: list[DeliveryOut]


def _told(webhook: Webhook) -> dict[str, object]:
    return {
        "id": webhook.id,
        "url": webhook.url,
        "statuses": webhook.statuses,
        "enabled": webhook.is_enabled,
        "created_at": webhook.created_at,
    }
