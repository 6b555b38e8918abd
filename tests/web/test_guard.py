"""Who may call: keys with scopes, families with their cookie and token, and nobody on their behalf."""

from __future__ import annotations

import asyncio

import httpx
import pytest
from pydantic import ValidationError
from starlette.responses import PlainTextResponse

from lubdub.cases.database import Database
from lubdub.cases.people import People
from lubdub.settings import Settings
from lubdub.web.envelope import Envelope
from lubdub.web.guard import cookie_name, csrf_token, session_cookie
from tests.web import family as pages
from tests.web.api.test_rest import problem
from tests.web.service import PATIENT, Portal, Service

BODY = {"patient": PATIENT}


class Family:
    """A browser with a session."""

    def __init__(self, service: Service) -> None:
        database = Database(service.settings.database)
        session = People(database).open_session(1.0)
        database.close()
        self.http = service.browser()
        self.http.cookies.set(cookie_name(service.settings), session.token)
        self.headers = {"X-CSRF-Token": csrf_token(session), "Origin": service.settings.address}


def test_without_key_or_session_nothing_opens(service: Service) -> None:
    http = service.browser()
    problem(http.post("/api/v1/cases", json=BODY), "not-signed-in")
    problem(http.get("/api/v1/cases/x", headers={"Authorization": "Bearer lubdub_guess"}), "not-signed-in")
    problem(http.get("/api/v1/cases/x", headers={"Authorization": "Basic eDp5"}), "not-signed-in")


def test_a_key_does_what_its_scopes_say(service: Service, portal: Portal) -> None:
    reader = service.portal("clinic", ("cases:read",))
    case = portal.open_case()
    assert reader.state(case)["id"] == case
    problem(reader.call("DELETE", f"/cases/{case}", 403), "scope-missing")
    writer = service.portal("clinic", ("cases:write",))
    problem(writer.call("GET", f"/cases/{case}", 403), "scope-missing")


def test_a_family_uses_rest_for_its_own_cases_alone(service: Service, portal: Portal) -> None:
    family, neighbour = pages.Family(service), Family(service)
    path = f"/api/v1/cases/{family.opened()}"
    assert family.http.get(path).status_code == 200
    problem(neighbour.http.get(path), "case-not-found")
    problem(portal.http.get(path), "case-not-found")
    problem(family.http.get(f"/api/v1/cases/{portal.open_case()}"), "case-not-found")


def test_a_family_opens_no_case_of_a_real_body_without_consent(service: Service) -> None:
    family = Family(service)
    problem(family.http.post("/api/v1/cases", json=BODY, headers=family.headers), "consent-missing")


@pytest.mark.parametrize(
    "forged",
    [
        {"Origin": "https://evil.example"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"X-CSRF-Token": "0" * 64},
        {"X-CSRF-Token": ""},
        {"Origin": ""},
    ],
)
def test_a_call_made_by_another_site_is_refused(service: Service, forged: dict[str, str]) -> None:
    family = Family(service)
    response = family.http.post("/api/v1/cases", json=BODY, headers=family.headers | forged)
    problem(response, "cross-site")


def test_a_bearer_call_takes_no_cookie(service: Service) -> None:
    family = Family(service)
    headers = family.headers | {"Authorization": "Bearer lubdub_guess"}
    problem(family.http.post("/api/v1/cases", json=BODY, headers=headers), "not-signed-in")


def test_every_answer_carries_the_guarding_headers(service: Service, portal: Portal) -> None:
    for response in (portal.http.get("/livez"), portal.http.get("/api/docs"), portal.http.get("/nothing")):
        assert "default-src 'self'" in response.headers["content-security-policy"]
        assert response.headers["cache-control"] == "no-store"
        assert response.headers["x-content-type-options"] == "nosniff"
        assert len(response.headers["x-request-id"]) == 16
    ids = {portal.http.get("/livez").headers["x-request-id"] for _ in range(3)}
    assert len(ids) == 3


def test_the_cookie_is_bound_to_the_host_when_there_is_https(service: Service) -> None:
    database = Database(service.settings.database)
    session = People(database).open_session(1.0)
    database.close()
    plain = session_cookie(service.settings, session)
    assert plain.startswith("lubdub=")
    sealed = session_cookie(Settings(behind_tls_proxy=True), session)
    assert sealed.startswith("__Host-lubdub=")
    assert sealed.endswith("; Secure")
    for cookie in (plain, sealed):
        assert "HttpOnly" in cookie
        assert "SameSite=Lax" in cookie
        assert "Domain" not in cookie


def test_listening_to_the_network_without_https_is_refused_in_words() -> None:
    with pytest.raises(ValidationError, match="LUBDUB_BEHIND_TLS_PROXY"):
        Settings(host="0.0.0.0")
    assert Settings(host="0.0.0.0", behind_tls_proxy=True).is_https
    for loopback in ("127.0.0.1", "::1", "localhost"):
        assert not Settings(host=loopback).is_https


def test_with_https_browsers_are_told_to_stay_with_it(service: Service) -> None:
    async def told(is_https: bool) -> str | None:
        transport = httpx.ASGITransport(Envelope(PlainTextResponse("here"), is_https))
        async with httpx.AsyncClient(transport=transport, base_url="https://lubdub") as http:
            return (await http.get("/")).headers.get("strict-transport-security")

    assert asyncio.run(told(True)) == "max-age=31536000; includeSubDomains"
    assert asyncio.run(told(False)) is None


def test_no_other_site_may_read_an_answer(service: Service, portal: Portal) -> None:
    for path in ("/", "/api/v1/cases", "/api/docs"):
        answer = portal.http.get(path, headers={"Origin": "https://evil.example"})
        assert not [name for name in answer.headers if name.startswith("access-control-")]
        assert answer.headers["cross-origin-resource-policy"] == "same-origin"
        assert answer.headers["referrer-policy"] == "same-origin"
