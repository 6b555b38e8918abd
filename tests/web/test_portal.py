"""What a portal needs beside a case: its keys and tokens, pages of cases, calls that may be repeated, and a sandbox."""

from __future__ import annotations

import base64
import os

import httpx
import pytest

from lubdub.cases import admin
from tests.web.api.test_rest import problem
from tests.web.service import PATIENT, Portal, Service

ALL = ("cases:read", "cases:write", "keys:manage", "webhooks:manage")


def speaking(service: Service, token: str) -> Portal:
    """A program that calls with this token."""
    headers = {"Authorization": f"Bearer {token}"}
    return Portal(httpx.Client(base_url=service.settings.address, headers=headers, timeout=30))


@pytest.fixture
def manager(service: Service) -> Portal:
    """A portal of its own that may do everything."""
    return service.portal(f"clinic {os.urandom(4).hex()}", ALL)


def token_call(service: Service, **form: str) -> httpx.Response:
    return httpx.post(f"{service.settings.address}/api/v1/oauth/token", data=form, timeout=30)


def test_a_portal_makes_rotates_and_ends_its_own_keys(service: Service, manager: Portal) -> None:
    made = manager.call("POST", "/keys", 201, json={"name": "night import", "scopes": ["cases:read"]}).json()
    reader = speaking(service, made["token"])
    reader.call("GET", "/cases", 200)
    problem(reader.call("GET", "/keys", 403), "scope-missing")
    listed = {key["id"]: key for key in manager.call("GET", "/keys", 200).json()["items"]}
    assert len(listed) == 2
    assert listed[made["id"]]["last_used_at"] is not None
    assert "token" not in listed[made["id"]]
    turned = manager.call("POST", f"/keys/{made['id']}/rotate", 201, json={"overlap_hours": 1}).json()
    assert (turned["name"], turned["scopes"]) == ("night import", ["cases:read"])
    for token in (made["token"], turned["token"]):
        speaking(service, token).call("GET", "/cases", 200)
    manager.call("POST", f"/keys/{turned['id']}/rotate", 201, json={"overlap_hours": 0})
    problem(speaking(service, turned["token"]).call("GET", "/cases", 401), "not-signed-in")
    manager.call("DELETE", f"/keys/{made['id']}", 204)
    problem(reader.call("GET", "/cases", 401), "not-signed-in")
    problem(manager.call("POST", f"/keys/{made['id']}/rotate", 409, json={}), "state-conflict")


def test_a_key_gives_no_more_than_it_has_and_sees_no_others(service: Service, manager: Portal) -> None:
    body = {"name": "x", "scopes": ["keys:manage"]}
    little = speaking(service, manager.call("POST", "/keys", 201, json=body).json()["token"])
    problem(little.call("POST", "/keys", 403, json=body | {"scopes": ["cases:read"]}), "scope-missing")
    mine = manager.call("GET", "/keys", 200).json()["items"]
    stronger = next(key["id"] for key in mine if "cases:read" in key["scopes"])
    problem(little.call("POST", f"/keys/{stronger}/rotate", 403, json={}), "scope-missing")
    other = service.portal(f"other {os.urandom(4).hex()}", ALL)
    for call in (("POST", f"/keys/{stronger}/rotate", 404), ("DELETE", f"/keys/{stronger}", 404)):
        problem(other.call(*call, json={} if call[0] == "POST" else None), "key-not-found")
    assert stronger not in other.call("GET", "/keys", 200).text


def test_a_familys_session_has_no_keys(service: Service) -> None:
    problem(service.browser().get("/api/v1/keys"), "not-signed-in")


def test_a_key_is_exchanged_for_a_token_that_can_do_less(service: Service, manager: Portal) -> None:
    made = manager.call("POST", "/keys", 201, json={"name": "app", "scopes": ["cases:read", "cases:write"]}).json()
    who = {"grant_type": "client_credentials", "client_id": made["id"], "client_secret": made["token"]}
    granted = token_call(service, **who, scope="cases:read")
    assert granted.status_code == 200
    assert granted.headers["cache-control"] == "no-store"
    said = granted.json()
    assert (said["token_type"], said["expires_in"], said["scope"]) == ("Bearer", 3600, "cases:read")
    app = speaking(service, said["access_token"])
    app.call("GET", "/cases", 200)
    problem(app.call("POST", "/cases", 403, json={"patient": PATIENT}), "scope-missing")
    basic = httpx.post(
        f"{service.settings.address}/api/v1/oauth/token",
        data={"grant_type": "client_credentials"},
        auth=(made["id"], made["token"]),
    )
    assert basic.json()["scope"] == "cases:read cases:write"
    manager.call("DELETE", f"/keys/{made['id']}", 204)
    problem(app.call("GET", "/cases", 401), "not-signed-in")


@pytest.mark.parametrize(
    ("change", "status", "error"),
    [
        ({"client_secret": "lubdub_guess"}, 401, "invalid_client"),
        ({"client_id": "somebody"}, 401, "invalid_client"),
        ({"grant_type": "password"}, 400, "unsupported_grant_type"),
        ({"scope": "keys:manage"}, 400, "invalid_scope"),
    ],
)
def test_a_token_is_refused_in_the_words_of_the_standard(
    service: Service, change: dict[str, str], status: int, error: str
) -> None:
    key, token = admin.create_key(service.settings.database, "clinic", ["cases:read"])
    who = {"grant_type": "client_credentials", "client_id": key.id, "client_secret": token}
    refused = token_call(service, **(who | change))
    assert (refused.status_code, refused.json()["error"]) == (status, error)
    assert refused.json()["error_description"]


def test_cases_come_page_by_page_and_none_of_others(manager: Portal, portal: Portal) -> None:
    mine = [manager.open_case(external_id=f"A-{number}") for number in range(5)]
    portal.open_case()
    seen: list[str] = []
    path: str | None = "/cases?limit=2"
    while path:
        page = manager.call("GET", path, 200)
        seen += [case["id"] for case in page.json()["items"]]
        link = page.links.get("next", {}).get("url")
        assert (link is None) == (page.json()["next_cursor"] is None)
        path = None if link is None else link.removeprefix("/api/v1")
        if len(seen) == 2:
            mine.append(manager.open_case(external_id="late"))
    assert seen == mine[4::-1]
    found = manager.call("GET", "/cases?external_id=A-3&status=awaiting_scan", 200).json()["items"]
    assert [case["id"] for case in found] == [mine[3]]
    assert manager.call("GET", "/cases?status=done", 200).json() == {"items": [], "next_cursor": None}
    problem(manager.call("GET", "/cases?cursor=made-up", 400), "bad-request")


def test_an_answer_that_did_not_change_is_not_sent_again(portal: Portal) -> None:
    case = portal.open_case()
    for path in (f"/cases/{case}", "/cases?limit=1"):
        first = portal.call("GET", path, 200)
        again = portal.call("GET", path, 304, headers={"If-None-Match": f'"x", {first.headers["etag"]}'})
        assert again.content == b""
        assert again.headers["etag"] == first.headers["etag"]
    known = portal.call("GET", f"/cases/{case}", 200).headers["etag"]
    portal.send(case, b"quick")
    assert portal.call("GET", f"/cases/{case}", 200, headers={"If-None-Match": known}).headers["etag"] != known


def test_a_run_repeated_with_its_idempotency_key_is_one_run(portal: Portal) -> None:
    case, key = portal.examined(b"quick"), {"Idempotency-Key": os.urandom(8).hex()}
    portal.call("PUT", f"/cases/{case}/landmarks", 202, json={}, headers=key)
    portal.wait(case, "done")
    again = portal.call("PUT", f"/cases/{case}/landmarks", 202, json={}, headers=key)
    assert again.json()["status"] == "done"
    other = portal.call("POST", f"/cases/{case}/landmarks/confirm", 422, headers=key)
    problem(other, "idempotency-mismatch")


def test_programs_are_told_how_many_calls_are_left(portal: Portal) -> None:
    first, second = (portal.call("GET", "/cases?limit=1", 200).headers for _ in range(2))
    assert first["ratelimit-limit"] == "100000"
    assert first["ratelimit-policy"] == "100000;w=60"
    assert int(second["ratelimit-remaining"]) <= int(first["ratelimit-remaining"]) < 100_000
    assert int(first["ratelimit-reset"]) <= 60


def test_a_sandbox_takes_samples_alone_and_says_so(service: Service, portal: Portal) -> None:
    _, token = admin.create_key(service.settings.database, "clinic", ALL, is_sandbox=True)
    assert token.startswith("lubdub_test_")
    sandbox = speaking(service, token)
    listed = sandbox.call("GET", "/samples", 200).json()["items"]
    one = next(sample for sample in listed if sample["landmarks"]["navel"])
    case = sandbox.call("POST", "/cases", 201, json={"patient": one["patient"]}).json()
    assert case["sandbox"] is True
    problem(sandbox.send(case["id"], b"a real body", expect=403), "sandbox-takes-samples")
    tus = {"Tus-Resumable": "1.0.0", "Content-Type": "application/offset+octet-stream", "Upload-Offset": "0"}
    metadata = "case " + base64.b64encode(case["id"].encode()).decode()
    begun = sandbox.call("POST", "/uploads", 201, headers=tus | {"Upload-Length": "5", "Upload-Metadata": metadata})
    path = begun.headers["location"].removeprefix("/api/v1")
    problem(sandbox.call("PATCH", path, 403, headers=tus, content=b"mummy"), "sandbox-takes-samples")
    assert sandbox.state(case["id"])["status"] == "awaiting_scan"
    scan = sandbox.http.get(one["scan"]).content
    sandbox.send(case["id"], scan)
    sandbox.wait(case["id"], "awaiting_landmarks")
    sandbox.call("PUT", f"/cases/{case['id']}/landmarks", 202, json=one["landmarks"])
    sandbox.wait(case["id"], "done")
    problem(portal.call("GET", f"/cases/{case['id']}", 404), "case-not-found")
    problem(sandbox.call("GET", "/samples/nobody/scan", 404), "sample-not-found")
    assert portal.call("GET", f"/cases/{portal.open_case()}", 200).json()["sandbox"] is False


def test_a_case_is_told_in_fhir_at_any_time_and_to_its_tenant_alone(service: Service, portal: Portal) -> None:
    consent = {"version": "clinic 3", "language": "en", "given_at": "2026-01-02T03:04:05Z", "child": "agreed"}
    case = portal.open_case(consent=consent)
    told = portal.call("GET", f"/cases/{case}/fhir", 200)
    assert told.headers["content-type"] == "application/fhir+json"
    resources = {entry["resource"]["resourceType"]: entry["resource"] for entry in told.json()["entry"]}
    assert set(resources) == {"Patient", "Task", "Consent"}
    assert (resources["Task"]["status"], resources["Consent"]["dateTime"]) == ("requested", consent["given_at"])
    portal.call("GET", f"/cases/{case}/fhir", 304, headers={"If-None-Match": told.headers["etag"]})
    problem(service.portal("another clinic").call("GET", f"/cases/{case}/fhir", 404), "case-not-found")


def test_our_own_codes_are_explained_to_everybody(service: Service) -> None:
    http = service.browser()
    system = http.get("/fhir/CodeSystem/listening-area").json()
    assert [concept["code"] for concept in system["concept"]] == ["aortic", "pulmonary", "tricuspid", "mitral"]
    for path in ("/fhir/CodeSystem/other", "/fhir/ConceptMap/listening-area-to-snomed"):
        assert http.get(path).status_code == 404


def test_a_portal_hands_in_the_familys_separate_yes_and_takes_it_back(service: Service, manager: Portal) -> None:
    case = manager.open_case()
    where = f"/cases/{case}/sharing"
    yes = {"version": "our words, 2", "language": "en", "given_at": "2026-01-02T03:04:05Z"}
    assert manager.call("GET", where, 200).json() == {"agreed": None}
    assert manager.call("PUT", where, 200, json=yes).json() == {"agreed": yes}
    assert manager.call("GET", where, 200).json() == {"agreed": yes}
    for wrong in ({"version": "1"}, yes | {"given_at": "yesterday"}, yes | {"given_at": "2026-01-02T03:04:05"}):
        problem(manager.call("PUT", where, 422, json=wrong), "invalid-input")
    problem(service.portal("elsewhere").call("PUT", where, 404, json=yes), "case-not-found")
    assert manager.call("DELETE", where, 200).json() == {"agreed": None}
    assert manager.call("GET", where, 200).json() == {"agreed": None}
