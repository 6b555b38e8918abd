"""Whatever routes there are: a case answers to whom it belongs, and is not there for anybody else."""

from __future__ import annotations

import json
import re
from typing import Any

import httpx
import pytest
from fastapi.routing import APIRoute

from lubdub.settings import Settings
from lubdub.web.app import create_app
from lubdub.web.openapi import openapi_json
from tests.web.family import Family
from tests.web.service import Portal, Service
from tests.web.staff import signed_in
from tests.web.test_portal import ALL

Route = tuple[str, str]
BODIES: dict[str, Any] = {
    "landmarks": {},
    "unit": {"unit": "m"},
    "embed": {"shows": "journey"},
    "sharing": {"version": "1", "language": "en", "given_at": "2026-01-01T00:00:00Z"},
}
"""What a REST call whose path ends so must send to be looked at at all."""
SIGN_IN = "/desk/sign-in"
PORTALS_ALONE = ("/api/v1/cases/{case_id}/embed", "/api/v1/cases/{case_id}/sharing")


def rest() -> list[Route]:
    """Method and path of every call about a case, also of those that are added later."""
    paths = json.loads(openapi_json())["paths"]
    return [(method.upper(), path) for path, methods in paths.items() if "{case_id}" in path for method in methods]


def pages() -> list[Route]:
    """The same of every page."""
    found, pending = set(), list(create_app(Settings()).routes)
    while pending:
        route = pending.pop()
        pending += getattr(getattr(route, "original_router", None), "routes", [])
        if isinstance(route, APIRoute) and not route.include_in_schema and "{case_id}" in route.path:
            found |= {(method, route.path) for method in route.methods}
    return sorted(found)


def of_desk(route: Route) -> bool:
    return route[1].startswith("/desk/")


def address(path: str, case: str) -> str:
    return re.sub(r"\{\w+(:\w+)?\}", "ab", path.replace("{case_id}", case))


def ask(http: httpx.Client, route: Route, case: str, headers: dict[str, str]) -> httpx.Response:
    method, path = route
    body = BODIES.get(path.rsplit("/", 1)[1])
    if method == "PUT" and body is None:
        return http.request(method, address(path, case), content=b"scan", headers=headers)
    return http.request(method, address(path, case), json=body, headers=headers)


@pytest.fixture(scope="module")
def cases(service: Service, portal: Portal) -> dict[str, str]:
    """A portal's case and a family's."""
    family = Family(service)
    return {"portal": portal.examined(b"quick"), "family": family.opened()}


def test_there_are_routes_to_ask() -> None:
    assert len(rest()) > 15
    assert len(pages()) > 25
    assert any(map(of_desk, pages()))


@pytest.mark.parametrize("whose", ["portal", "family"])
def test_another_portal_finds_no_case_by_any_call(service: Service, cases: dict[str, str], whose: str) -> None:
    stranger = service.portal("a stranger", ALL)
    for route in rest():
        answer = ask(stranger.http, route, cases[whose], {})
        assert (route, answer.status_code, answer.json()["type"]) == (route, 404, "/problems/case-not-found")


@pytest.mark.parametrize("whose", ["portal", "family"])
def test_another_family_finds_no_case_by_any_call_or_page(service: Service, cases: dict[str, str], whose: str) -> None:
    stranger = Family(service)
    own = {"X-CSRF-Token": stranger.token(), "Origin": service.settings.address}
    for route in rest():
        expected = 401 if route[1] in PORTALS_ALONE else 404
        assert (route, ask(stranger.http, route, cases[whose], own).status_code) == (route, expected)
    form = {"csrf_token": own["X-CSRF-Token"]}
    for method, path in pages():
        answer = stranger.http.request(
            method, address(path, cases[whose]), data=form, headers=own, follow_redirects=not of_desk((method, path))
        )
        if of_desk((method, path)):
            assert answer.status_code in (303, 401, 403), (method, path)
            assert answer.headers.get("location", SIGN_IN).startswith(SIGN_IN), (method, path)
        else:
            assert (method, path, answer.status_code) == (method, path, 404)


@pytest.mark.parametrize("whose", ["portal", "family"])
def test_a_clinician_of_another_organisation_finds_no_case(service: Service, cases: dict[str, str], whose: str) -> None:
    stranger = signed_in(service, "lead", "Stranger House")
    form = {"csrf_token": stranger.token()}
    own = {"X-CSRF-Token": form["csrf_token"], "Origin": service.settings.address}
    for method, path in filter(of_desk, pages()):
        answer = stranger.http.request(method, address(path, cases[whose]), data=form, headers=own)
        assert (method, path, answer.status_code) == (method, path, 404)


def test_nobody_at_all_finds_no_case_by_any_call(service: Service, cases: dict[str, str]) -> None:
    for route in rest():
        assert (route, ask(service.browser(), route, cases["portal"], {}).status_code) == (route, 401)
