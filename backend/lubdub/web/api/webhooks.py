"""REST: webhooks by the Standard Webhooks specification, their secrets and their log."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Response

from lubdub.jobs.addresses import AddressRefused, destination
from lubdub.settings import Settings
from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import BEARER, SettingsDep, WebhookManagerDep, WebhooksDep
from lubdub.web.problems import Problem
from lubdub.web.repeating import RepeatableDep
from lubdub.web.schemas import problems
from lubdub.web.schemas_webhooks import (
    DeliveriesOut,
    DeliveryOut,
    NewWebhookOut,
    WebhookChangeIn,
    WebhookIn,
    WebhookOut,
    WebhooksOut,
)

USUAL = problems("bad-request", "not-signed-in", "scope-missing", "webhook-not-found", "delivery-not-found")
USUAL |= problems("invalid-input", "too-many-requests")
TAKES_ADDRESS = problems("too-large", "state-conflict", "invalid-input", "webhook-address", "idempotency-mismatch")

router = APIRouter(tags=["webhooks"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)

WebhookId = Annotated[str, Path(max_length=64, description="The webhook's id.")]
DeliveryId = Annotated[str, Path(max_length=64, description="The message's id, as `webhook-id` says it.")]
Newest = Annotated[int, Query(ge=1, le=100, description="At most so many.")]


@router.get("/webhooks", responses=UNCHANGED)
def list_webhooks(actor: WebhookManagerDep, webhooks: WebhooksDep) -> WebhooksOut:
    """Your webhooks, oldest first."""
    return WebhooksOut(items=[WebhookOut.of(one) for one in webhooks.all_of(actor)])


@router.post("/webhooks", status_code=201, responses=TAKES_ADDRESS)
def create_webhook(
    new: WebhookIn,
    actor: WebhookManagerDep,
    webhooks: WebhooksDep,
    settings: SettingsDep,
    repeatable: RepeatableDep,
) -> NewWebhookOut:
    """Be told when a case changes: which case and which state, never anything about a person. The answer has the
    secret. A message is tried for about a day until your answer is 200 to 299, within 10 seconds."""
    _refuse_private(new.url, settings)
    return NewWebhookOut.with_secret(webhooks.create(actor, new.url, new.statuses, repeatable))


@router.get("/webhooks/{webhook_id}", responses=UNCHANGED)
def read_webhook(webhook_id: WebhookId, actor: WebhookManagerDep, webhooks: WebhooksDep) -> WebhookOut:
    """One webhook."""
    return WebhookOut.of(webhooks.get(actor, webhook_id))


@router.patch("/webhooks/{webhook_id}", responses=TAKES_ADDRESS)
def change_webhook(
    webhook_id: WebhookId,
    change: WebhookChangeIn,
    actor: WebhookManagerDep,
    webhooks: WebhooksDep,
    settings: SettingsDep,
) -> WebhookOut:
    """Change address or states, turn it off or on. What waited when it was turned off is sent later."""
    webhooks.get(actor, webhook_id)
    if change.url is not None:
        _refuse_private(change.url, settings)
    return WebhookOut.of(webhooks.change(actor, webhook_id, change.url, change.statuses, change.enabled))


@router.delete("/webhooks/{webhook_id}", status_code=204)
def delete_webhook(webhook_id: WebhookId, actor: WebhookManagerDep, webhooks: WebhooksDep) -> Response:
    """Forget the webhook and its log."""
    webhooks.delete(actor, webhook_id)
    return Response(status_code=204)


@router.post("/webhooks/{webhook_id}/rotate")
def rotate_webhook_secret(webhook_id: WebhookId, actor: WebhookManagerDep, webhooks: WebhooksDep) -> NewWebhookOut:
    """A new secret. For 24 hours messages carry two signatures, so that you can change over."""
    return NewWebhookOut.with_secret(webhooks.rotate(actor, webhook_id))


@router.post("/webhooks/{webhook_id}/test", status_code=202)
def send_test_message(webhook_id: WebhookId, actor: WebhookManagerDep, webhooks: WebhooksDep) -> DeliveryOut:
    """Send a message of the type `webhook.test`."""
    return DeliveryOut.of(webhooks.test(actor, webhook_id))


@router.get("/webhooks/{webhook_id}/deliveries", responses=UNCHANGED)
def list_deliveries(
    webhook_id: WebhookId, actor: WebhookManagerDep, webhooks: WebhooksDep, limit: Newest = 50
) -> DeliveriesOut:
    """What was sent in the last 30 days, newest first, with every try."""
    return DeliveriesOut(items=[DeliveryOut.of(one) for one in webhooks.deliveries(actor, webhook_id, limit)])


@router.post("/webhooks/{webhook_id}/deliveries/{delivery_id}/replay", status_code=202)
def replay_delivery(
    webhook_id: WebhookId, delivery_id: DeliveryId, actor: WebhookManagerDep, webhooks: WebhooksDep
) -> DeliveryOut:
    """Send a message again, under the same `webhook-id`."""
    return DeliveryOut.of(webhooks.replay(actor, webhook_id, delivery_id))


def _refuse_private(url: str, settings: Settings) -> None:
    """Said at once, for a portal's sake; the courier looks again at every try."""
    try:
        destination(url, settings.webhooks_to_private)
    except AddressRefused as refused:
        raise Problem("webhook-address", str(refused)) from refused
