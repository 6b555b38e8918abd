"""Who may call what: every route of the application stands in this table, and every kind of caller tries every one."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import httpx
import pytest
import websockets
from starlette.routing import BaseRoute

from lubdub.settings import Settings
from lubdub.web.app import create_app
from tests.web.family import Family
from tests.web.reviewing import CURRENT, in_review
from tests.web.service import Service
from tests.web.staff import Desk, hidden, signed_in
from tests.web.test_portal import ALL

Who = Literal["anonymous", "family", "other", "clinician", "lead", "administrator", "portal"]
DESK: tuple[Who, ...] = ("other", "clinician", "lead", "administrator")
EVERYBODY: tuple[Who, ...] = ("anonymous", "family", *DESK, "portal")
BROWSERS: tuple[Who, ...] = ("anonymous", "family", *DESK)

MAY: dict[str, tuple[Who, ...]] = {
    "all": EVERYBODY,
    "browser": BROWSERS,
    "family": ("family",),
    "rest": ("family", "portal"),
    "portal": ("portal",),
    "desk": DESK,
    "case": ("clinician", "lead", "administrator"),
    "lead": ("lead", "administrator"),
    "administrator": ("administrator",),
}
"""Kind of route -> who gets past its door. `other` is a lead of another organisation, whose own pages open."""
ALSO: dict[str, Who] = {"lead": "other"}

TABLE = """
all: GET /api/docs/scaling
all: GET /api/docs, GET /api/docs.css
all: GET /api/docs/security, GET /api/docs/operation
all: GET /api/embed-messages.schema.json, GET /api/v1/openapi.json
all: HEAD /api/v1/openapi.json, GET /favicon.ico, GET /fhir/CodeSystem/{name}, GET /livez, GET /readyz
all: GET /fhir/ConceptMap/listening-area-to-snomed, GET /problems/{kind}, GET /stickers.pdf, GET /language
all: GET /static/nhsuk.css, GET /static/nhsuk.js, GET /static/tus.js, GET /static/{path:path}, GET /embed/{token}
all: GET /desk/oidc, GET /desk/oidc/callback, POST /api/v1/oauth/token, OPTIONS /api/v1/uploads
browser: GET /, POST /anew, GET /ask/{name}, POST /ask/{name}, GET /consent, POST /consent, GET /consent/child
browser: POST /consent/child, GET /handoff, POST /handoff, GET /invited, POST /invited, GET /not-now, GET /stop
browser: POST /samples, GET /desk/sign-in, POST /desk/sign-in, POST /desk/sign-in/passkey, GET /desk/join
browser: POST /desk/sign-in/passkey/options, POST /desk/join, POST /desk/join/password, POST /desk/join/passkey
browser: POST /desk/join/passkey/options, GET /cases/{case_id}/removed
family: GET /cases/{case_id}, POST /cases/{case_id}/cancel, GET /cases/{case_id}/checking, GET /cases/{case_id}/feel
family: POST /cases/{case_id}/feel, GET /cases/{case_id}/guide, POST /cases/{case_id}/guide
family: GET /cases/{case_id}/guide/{app}, GET /cases/{case_id}/handoff, POST /cases/{case_id}/handoff
family: GET /cases/{case_id}/handoff/state, GET /cases/{case_id}/picture, GET /cases/{case_id}/points
family: POST /cases/{case_id}/points, GET /cases/{case_id}/points/live, GET /cases/{case_id}/points/panel
family: GET /cases/{case_id}/ready, POST /cases/{case_id}/ready, GET /cases/{case_id}/refused
family: GET /cases/{case_id}/remove, POST /cases/{case_id}/remove, GET /cases/{case_id}/result
family: GET /cases/{case_id}/scan, POST /cases/{case_id}/scan, POST /cases/{case_id}/send, GET /cases/{case_id}/size
family: POST /cases/{case_id}/size, GET /cases/{case_id}/state, POST /cases/{case_id}/take-back
family: POST /cases/{case_id}/unit, GET /cases/{case_id}/waiting, POST /cases/{case_id}/share
family: GET /view/{case_id}/, GET /view/{case_id}/{window}/
rest: GET /api/v1/cases, POST /api/v1/cases, GET /api/v1/cases/{case_id}, DELETE /api/v1/cases/{case_id}
rest: POST /api/v1/cases/{case_id}/cancel, GET /api/v1/cases/{case_id}/events, GET /api/v1/cases/{case_id}/fhir
rest: PUT /api/v1/cases/{case_id}/landmarks, POST /api/v1/cases/{case_id}/landmarks/confirm
rest: GET /api/v1/cases/{case_id}/result, POST /api/v1/cases/{case_id}/review, DELETE /api/v1/cases/{case_id}/review
rest: GET /api/v1/cases/{case_id}/scan, PUT /api/v1/cases/{case_id}/scan, GET /api/v1/cases/{case_id}/scan.ply
rest: PUT /api/v1/cases/{case_id}/scan/unit, GET /api/v1/cases/{case_id}/sheet.pdf
rest: GET /api/v1/cases/{case_id}/view.html, POST /api/v1/uploads, DELETE /api/v1/uploads/{upload_id}
rest: HEAD /api/v1/uploads/{upload_id}, PATCH /api/v1/uploads/{upload_id}
portal: GET /api/v1/cases/{case_id}/sharing, PUT /api/v1/cases/{case_id}/sharing
portal: DELETE /api/v1/cases/{case_id}/sharing
portal: POST /api/v1/cases/{case_id}/embed, GET /api/v1/embedding, PUT /api/v1/embedding, GET /api/v1/keys
portal: POST /api/v1/keys, DELETE /api/v1/keys/{key_id}, POST /api/v1/keys/{key_id}/rotate, GET /api/v1/webhooks
portal: POST /api/v1/webhooks, DELETE /api/v1/webhooks/{webhook_id}, GET /api/v1/webhooks/{webhook_id}
portal: PATCH /api/v1/webhooks/{webhook_id}, GET /api/v1/webhooks/{webhook_id}/deliveries
portal: POST /api/v1/webhooks/{webhook_id}/deliveries/{delivery_id}/replay
portal: POST /api/v1/webhooks/{webhook_id}/rotate, POST /api/v1/webhooks/{webhook_id}/test
rest: GET /api/v1/samples, GET /api/v1/samples/{name}/scan
desk: GET /desk, GET /desk/live, POST /desk/sign-out, GET /desk/account, GET /desk/account/password
desk: POST /desk/account/password, POST /desk/account/passkeys, POST /desk/account/passkeys/options
desk: POST /desk/account/passkeys/remove, POST /desk/account/sessions/end, POST /desk/account/sessions/end-others
desk: GET /desk/families, POST /desk/families/invite, POST /desk/families/again, POST /desk/families/uninvite
desk: GET /desk/references, GET /desk/references/{body}, GET /desk/references/{body}/panel
desk: GET /desk/references/{body}/live, POST /desk/references/{body}/look, POST /desk/references/{body}/review
desk: GET /desk/body/{body}/{window}/
case: GET /desk/cases/{case_id}, GET /desk/cases/{case_id}/live, POST /desk/cases/{case_id}/look
case: GET /desk/cases/{case_id}/panel, POST /desk/cases/{case_id}/review, GET /desk/view/{case_id}/{window}/
lead: GET /desk/audit, GET /desk/audit.csv, GET /desk/audit.json, GET /desk/holds, POST /desk/holds/place
lead: POST /desk/holds/lift
administrator: GET /desk/people, POST /desk/people/invite, POST /desk/people/uninvite, POST /desk/people/renew
administrator: POST /desk/people/role, POST /desk/people/disable, POST /desk/people/enable
"""
KIND = {
    route.strip(): kind.strip()
    for kind, _, routes in (line.partition(":") for line in TABLE.strip().splitlines())
    for route in routes.split(", ")
}


def may(who: Who, route: str) -> bool:
    """Whether this caller gets past the door of this route. A portal has no form of ours, but may look at its page."""
    kind = KIND[route]
    if who == "portal" and kind == "browser":
        return route.startswith("GET ")
    return who in MAY[kind] or ALSO.get(kind) == who


SOCKETS = {
    "/view/{case_id}": "family",
    "/view/{case_id}/{window}": "family",
    "/desk/view/{case_id}/{window}": "case",
    "/desk/body/{body}/{window}": "desk",
}
"""Path of each socket -> kind of route. Whoever may not is refused before it opens."""
BODY = "girl-06"
DOOR = {"not-signed-in", "scope-missing", "role-missing", "cross-site", "case-not-found"}
"""The problems of whoever may not; every other answer, also another problem, is past the door."""
LAST = ("POST /cases/{case_id}/remove", "DELETE /api/v1/cases/{case_id}")
"""What leaves nothing to be asked about is asked last."""


def all_routes() -> set[str]:
    """Method and full path of every route, and the paths of sockets."""

    def walk(routes: list[BaseRoute], prefix: str) -> Iterator[str]:
        for route in routes:
            inner = getattr(getattr(route, "original_router", None), "routes", None)
            if inner is not None:
                yield from walk(inner, prefix + getattr(getattr(route, "include_context", None), "prefix", ""))
            else:
                path = prefix + route.path  # type: ignore[attr-defined]
                yield from (f"{method} {path}" for method in getattr(route, "methods", None) or {"SOCKET"})

    return set(walk(create_app(Settings()).routes, ""))


def test_every_route_stands_in_the_table_and_every_row_is_a_route() -> None:
    assert all_routes() == set(KIND) | {f"SOCKET {path}" for path in SOCKETS}
    assert sum(len(routes.split(", ")) for routes in TABLE.strip().splitlines()) == len(KIND)
    assert set(KIND.values()) == set(MAY)


@dataclass
class Caller:
    """Somebody with what they have to show: a key, or the sessions of a browser and the tokens of their forms.

    rest: the same towards the REST interface, where only a family shows a family's session.
    """

    http: httpx.Client
    rest: httpx.Client
    case: str
    tokens: dict[str, str] = field(default_factory=dict)

    def ask(self, route: str, case: str) -> str:
        """The kind of problem this route answers with; empty for none."""
        method, path = route.split(" ")
        address = path.replace("{case_id}", case)
        for hole in ("{name}", "{token}", "{path:path}", "{kind}", "{upload_id}", "{key_id}", "{webhook_id}", "{app}"):
            address = address.replace(hole, "none")
        address = address.replace("{delivery_id}", "none").replace("{window}", "ab").replace("{body}", BODY)
        token = self.tokens.get("desk" if path.startswith("/desk") else "family")
        headers = {"Accept": "application/json"} | ({"X-CSRF-Token": token} if token else {})
        headers["Tus-Resumable"] = "1.0.0"
        http = self.rest if path.startswith("/api/") else self.http
        with http.stream(method, address, headers=headers) as answer:
            if answer.status_code < 400:
                assert "/desk/sign-in" not in answer.headers.get("location", "") or path == "/desk/sign-out"
                return ""
            answer.read()
            if method == "HEAD":
                return "not-signed-in" if answer.status_code == 401 else ""
            if "json" not in answer.headers["content-type"]:
                return ""  # a page that says what is wrong with a form is past the door
            return str(answer.json().get("type", "")).removeprefix("/problems/")


def browser_of(service: Service, who: Who) -> Caller:
    """A browser at the family's pages and, for clinicians, at the desk, with the tokens of both."""
    family = Family(service)
    family.http.follow_redirects = False
    family.http.headers["Origin"] = service.settings.address
    tokens = {"family": family.token()}
    if who in DESK:
        desk = signed_in(service, "lead" if who == "other" else who, f"{'Other' if who == 'other' else 'Role'} House")  # type: ignore[arg-type]
        tokens["desk"] = desk.token()
    else:
        desk = Desk(service)
        tokens["desk"] = hidden(desk.get("/desk/sign-in"), "csrf_token")
    family.http.cookies.update(desk.http.cookies)
    family.http.follow_redirects = True
    case = family.opened() if who == "family" else ""
    family.http.follow_redirects = False
    desk.http.headers["Origin"] = service.settings.address
    return Caller(family.http, family.http if who == "family" else desk.http, case, tokens)


@pytest.fixture(scope="module")
def house_case(service: Service) -> str:
    return service.portal("Role House").done(b"quick")


@pytest.fixture(scope="module")
def family_case(service: Service) -> str:
    return Family(service).opened()


def caller(service: Service, who: Who) -> Caller:
    if who == "portal":
        portal = service.portal("Role House", ALL)
        portal.http.follow_redirects = False
        return Caller(portal.http, portal.http, portal.open_case())
    return browser_of(service, who)


@pytest.mark.parametrize("who", EVERYBODY)
def test_each_caller_gets_past_the_doors_that_are_theirs_and_no_others(
    service: Service, who: Who, house_case: str, family_case: str
) -> None:
    one = caller(service, who)
    wrong = {}
    for route in sorted(KIND, key=lambda route: (route in LAST, route)):
        kind = KIND[route]
        is_in = may(who, route)
        case = house_case if kind == "case" else one.case if is_in and one.case else family_case
        if route == "POST /desk/sign-out" and is_in:
            one = caller(service, who)  # it is over afterwards
        problem = one.ask(route, case)
        if route == "POST /desk/sign-out" and is_in:
            one = caller(service, who)
        if (problem not in DOOR) != is_in:
            wrong[route] = problem
    assert wrong == {}


@pytest.mark.parametrize("who", EVERYBODY)
def test_the_desk_tells_strangers_from_those_whose_role_is_too_small(service: Service, who: Who) -> None:
    one = caller(service, who)
    for route, kind in KIND.items():
        if kind in ("lead", "administrator") and not may(who, route):
            expected = "role-missing" if who in DESK else "not-signed-in"
            assert (route, one.ask(route, "")) == (route, expected)


@pytest.fixture(scope="module")
def pictured(service: Service) -> tuple[Family, str]:
    owner = Family(service)
    case = owner.confirmed()
    owner.get(f"/view/{case}/")
    return owner, case


@pytest.fixture(scope="module")
def reviewed_case(service: Service) -> str:
    return in_review(service, "Role House")


def opens(service: Service, http: httpx.Client, path: str) -> bool:
    """Whether the socket opens for a browser with these cookies, or a portal with this key, at a page of ours."""
    shown = {name: http.headers[name] for name in ("Authorization",) if name in http.headers}
    if http.cookies:
        shown["Cookie"] = "; ".join(f"{one.name}={one.value}" for one in http.cookies.jar)
    address = service.settings.address

    async def attempt() -> None:
        there = address.replace("http", "ws") + path
        async with websockets.connect(there, origin=address, additional_headers=shown, subprotocols=[CURRENT]):  # type: ignore[arg-type]
            pass

    try:
        asyncio.run(attempt())
    except websockets.InvalidStatus:
        return False
    return True


@pytest.mark.parametrize("who", EVERYBODY)
def test_each_caller_gets_the_pictures_that_are_theirs_and_no_others(
    service: Service, who: Who, pictured: tuple[Family, str], reviewed_case: str
) -> None:
    owner, own_case = pictured
    one = caller(service, who)
    if who in MAY["case"]:
        one.http.get(f"/desk/view/{reviewed_case}/ab/").raise_for_status()
    if who in DESK:
        one.http.get(f"/desk/body/{BODY}/ab/").raise_for_status()
    wrong = {}
    for path, kind in SOCKETS.items():
        for case, kind_of_case in ((own_case, "family"), (reviewed_case, "case")):
            address = path.replace("{case_id}", case).replace("{window}", "ab").replace("{body}", BODY)
            is_in = kind == "desk" or kind == kind_of_case == "case"
            if opens(service, one.http, address) != (is_in and who in MAY[kind]):
                wrong[address] = who
            if who == "family" and opens(service, owner.http, address) != (kind == kind_of_case == "family"):
                wrong[address] = "owner"
    assert wrong == {}
