"""What strangers see of how this is built and run: nothing; and what we see of strangers: that they were refused."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import pytest

from lubdub.settings import Settings
from lubdub.web.app import create_app
from tests.web.desk.test_desk import sign_in
from tests.web.service import Portal, Service
from tests.web.staff import PASSWORD, Desk, hidden, new_account, signed_in
from tests.web.test_operation import logged, numbers


@pytest.mark.parametrize("before", ["/", "/static/", "/api/", "/desk/"])
@pytest.mark.parametrize("path", [".git/HEAD", ".git/config", ".svn/entries", ".env", "requirements.txt", "backend/"])
def test_the_sources_and_their_history_are_not_served(service: Service, before: str, path: str) -> None:
    answer = service.browser().get(f"{before}{path}", headers={"Accept": "application/json"})
    assert (answer.status_code, answer.json()["type"]) == (404, "/problems/page-not-found")


@pytest.mark.parametrize("role", ["web", "view"])
def test_there_is_no_debug_mode_to_be_left_on(role: str) -> None:
    app = create_app(Settings(log_level="debug"), role)  # type: ignore[arg-type]
    assert not app.debug
    assert [name for name in Settings.model_fields if "debug" in name or "reload" in name] == []


def nobody(service: Service, portal: Portal) -> httpx.Response:
    return service.browser().get("/api/v1/cases")


def too_small_a_key(service: Service, portal: Portal) -> httpx.Response:
    return portal.http.get("/api/v1/keys")


def too_small_a_role(service: Service, portal: Portal) -> httpx.Response:
    return signed_in(service).http.get("/desk/people")


def another_site(service: Service, portal: Portal) -> httpx.Response:
    return service.browser().post("/anew", headers={"Origin": "https://evil.example"})


def another_name(service: Service, portal: Portal) -> httpx.Response:
    return service.browser().get("/", headers={"Host": "evil.example"})


def nonsense(service: Service, portal: Portal) -> httpx.Response:
    return portal.http.post("/api/v1/cases", json={"patient": "ada@heart.example"})


def too_much(service: Service, portal: Portal) -> httpx.Response:
    return portal.http.post("/api/v1/cases", content=b" " * 2_000_000)


def out_of_turn(service: Service, portal: Portal) -> httpx.Response:
    return portal.http.put(f"/api/v1/cases/{portal.open_case()}/landmarks", json={})


def a_wrong_password(service: Service, portal: Portal) -> httpx.Response:
    return sign_in(Desk(service), new_account(service), 422, password="ada@heart.example")


def a_wrong_password_before_a_new_one(service: Service, portal: Portal) -> httpx.Response:
    desk = signed_in(service)
    secret = hidden(desk.get("/desk/account/password"), "secret")
    return desk.post("/desk/account/password", 422, secret=secret, current="ada@heart.example")


TRIES: dict[str, list[Callable[[Service, Portal], httpx.Response]]] = {
    "not-signed-in": [nobody, a_wrong_password, a_wrong_password_before_a_new_one],
    "scope-missing": [too_small_a_key],
    "role-missing": [too_small_a_role],
    "cross-site": [another_site],
    "unknown-host": [another_name],
    "invalid-input": [nonsense],
    "too-large": [too_much],
    "state-conflict": [out_of_turn],
}


@pytest.mark.parametrize(("kind", "attempt"), [(kind, one) for kind, found in TRIES.items() for one in found])
def test_a_refusal_stands_in_the_log_and_the_numbers_by_its_kind_and_without_who(
    service: Service, portal: Portal, kind: str, attempt: Callable[[Service, Portal], httpx.Response]
) -> None:
    answer = attempt(service, portal)
    assert answer.status_code >= 400
    lines = logged(service, "", request_id=answer.headers["x-request-id"])
    assert [line["kind"] for line in lines if line["event"] == "refused"] == [kind]
    assert not any(secret in str(lines) for secret in ("@heart.example", PASSWORD, "lubdub_", "evil"))
    assert f'lubdub_problems_total{{kind="{kind}"}}' in numbers(service)
