"""Webhooks by REST, delivered by the running worker to a receiver that really listens."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator

import pytest
from standardwebhooks import Webhook

from tests.receiver import Receiver, receiver
from tests.web.api.test_rest import problem
from tests.web.service import Portal, Service, eventually
from tests.web.test_portal import ALL


@pytest.fixture
def told() -> Iterator[Receiver]:
    with receiver() as listening:
        yield listening


@pytest.fixture
def manager(service: Service) -> Portal:
    return service.portal(f"clinic {os.urandom(4).hex()}", ALL)


def test_a_portal_is_told_when_its_case_is_done(manager: Portal, told: Receiver) -> None:
    body = {"url": told.url, "statuses": ["awaiting_landmarks", "done"]}
    made = manager.call("POST", "/webhooks", 201, json=body).json()
    case = manager.done(b"quick")
    eventually(lambda: len(told.taken) == 2)
    said = [Webhook(made["secret"]).verify(content, headers) for headers, content in told.taken]
    assert {one["data"]["status"] for one in said} == {"awaiting_landmarks", "done"}
    assert {one["data"]["id"] for one in said} == {case}
    path = f"/webhooks/{made['id']}/deliveries"
    eventually(lambda: all(one["state"] == "delivered" for one in manager.call("GET", path, 200).json()["items"]))
    newest = manager.call("GET", path, 200).json()["items"][0]
    assert newest["attempts"][0]["status"] == 204
    assert json.loads(newest["body"])["type"] == newest["type"]
    manager.call("POST", f"{path}/{newest['id']}/replay", 202)
    eventually(lambda: [headers["webhook-id"] for headers, _ in told.taken].count(newest["id"]) == 2)


def test_a_webhook_is_made_once_changed_tested_and_deleted(manager: Portal, told: Receiver) -> None:
    key = {"Idempotency-Key": os.urandom(8).hex()}
    made = manager.call("POST", "/webhooks", 201, json={"url": told.url}, headers=key).json()
    assert manager.call("POST", "/webhooks", 201, json={"url": told.url}, headers=key).json() == made
    path = f"/webhooks/{made['id']}"
    [listed] = manager.call("GET", "/webhooks", 200).json()["items"]
    assert listed == manager.call("GET", path, 200).json()
    assert "secret" not in listed
    assert manager.call("PATCH", path, 200, json={"enabled": False}).json()["enabled"] is False
    assert manager.call("PATCH", path, 200, json={"enabled": True, "statuses": ["done"]}).json()["statuses"] == ["done"]
    turned = manager.call("POST", f"{path}/rotate", 200).json()["secret"]
    assert turned != made["secret"]
    assert manager.call("POST", f"{path}/test", 202).json()["type"] == "webhook.test"
    eventually(lambda: told.taken)
    headers, content = told.taken[0]
    assert Webhook(turned).verify(content, headers)["type"] == "webhook.test"
    manager.call("DELETE", path, 204)
    problem(manager.call("GET", path, 404), "webhook-not-found")


def test_another_portals_webhook_is_not_there(service: Service, manager: Portal, told: Receiver) -> None:
    made = manager.call("POST", "/webhooks", 201, json={"url": told.url}).json()
    other = service.portal(f"other {os.urandom(4).hex()}", ALL)
    path = f"/webhooks/{made['id']}"
    for call in (
        ("GET", path),
        ("DELETE", path),
        ("POST", f"{path}/rotate"),
        ("POST", f"{path}/test"),
        ("GET", f"{path}/deliveries"),
        ("POST", f"{path}/deliveries/msg_x/replay"),
    ):
        problem(other.call(*call, 404), "webhook-not-found")
    problem(other.call("PATCH", path, 404, json={"enabled": False}), "webhook-not-found")
    problem(manager.call("POST", f"{path}/deliveries/msg_x/replay", 404), "delivery-not-found")
    assert other.call("GET", "/webhooks", 200).json()["items"] == []
    reader = service.portal("clinic", ("cases:read",))
    problem(reader.call("GET", "/webhooks", 403), "scope-missing")


@pytest.mark.parametrize("url", ["ftp://portal.example/", "https://user:word@127.0.0.1/", "nothing"])
def test_an_address_that_is_not_called_is_refused_at_once(manager: Portal, url: str) -> None:
    problem(manager.call("POST", "/webhooks", 422, json={"url": url}), "webhook-address")
