"""The desk's door: the first link, accounts, signing in and out, sessions, and forms of other sites."""

from __future__ import annotations

import time

import httpx
import pytest
from fastapi import FastAPI, WebSocket
from fastapi.testclient import TestClient
from starlette.requests import Request
from starlette.testclient import WebSocketDenialResponse

from lubdub.cases.admin import first_link
from lubdub.cases.credentials import code_at
from lubdub.cases.desk_values import ROLES, Role
from lubdub.settings import Settings
from lubdub.web.deps import AdministratorDep, ClinicianDep, LeadDep
from lubdub.web.desk.common import device_of
from lubdub.web.guard import desk_cookie, new_visitor
from lubdub.web.problems import install_problems
from lubdub.web.services import open_services
from tests.web.service import Service, free_port
from tests.web.staff import PASSWORD, Account, Desk, hidden, new_account, signed_in, staff_of


@pytest.fixture
def empty(tmp_path: object) -> Settings:
    return Settings(data_dir=tmp_path, port=free_port())  # type: ignore[arg-type]


def sign_in(desk: Desk, account: Account, expect: int = 200, **changes: str) -> httpx.Response:
    fields = {"email": account.clinician.email, "password": PASSWORD, "code": account.code} | changes
    return desk.post("/desk/sign-in", expect, token=desk.token("/desk/sign-in"), **fields)


def test_nobody_sees_the_desk_without_signing_in(service: Service) -> None:
    stranger = Desk(service)
    page = stranger.http.get("/desk/account")
    assert page.url.path == "/desk/sign-in"
    assert hidden(page.text, "back") == "/desk/account"
    script = stranger.http.get("/desk/account", headers={"Accept": "application/json"})
    assert (script.status_code, script.json()["type"]) == (401, "/problems/not-signed-in")


def test_password_and_code_lead_to_where_one_wanted(service: Service) -> None:
    account, desk = new_account(service), Desk(service)
    assert sign_in(desk, account, back="/desk/account").url.path == "/desk/account"
    page = desk.get("/desk")
    assert account.clinician.name in page
    assert "Heart House" in page
    assert desk.http.get("/desk/sign-in").url.path == "/desk"


@pytest.mark.parametrize("back", ["https://evil.example/", "//evil.example", "/\\evil.example", "desk"])
def test_signing_in_leads_nowhere_else(service: Service, back: str) -> None:
    assert sign_in(Desk(service), new_account(service), back=back).url == f"{service.settings.address}/desk"


def test_what_was_wrong_is_not_told(service: Service) -> None:
    account, desk = new_account(service), Desk(service)
    said = [
        sign_in(desk, account, 422, **wrong).text.split("<main", 1)[1].replace(account.clinician.email, "")
        for wrong in ({"password": "wrong"}, {"code": "000000"}, {"email": "nobody@heart.example"})
    ]
    plain = {text.split("</div>", 1)[0] for text in said}
    assert len(plain) == 1
    assert "do not fit together" in plain.pop()


def test_guessing_ends_in_a_sentence(service: Service) -> None:
    account, desk = new_account(service), Desk(service)
    for _ in range(10):
        sign_in(desk, account, 422, password="wrong")
    assert "Too many tries" in sign_in(desk, account, 422).text


def test_the_cookie_changes_when_one_signs_in_and_out(service: Service) -> None:
    account, desk = new_account(service), Desk(service)
    seen = []
    for act in (lambda: desk.get("/desk/sign-in"), lambda: sign_in(desk, account), lambda: desk.post("/desk/sign-out")):
        act()
        seen.append(desk.http.cookies["lubdub-desk"])
    assert len(set(seen)) == 3
    desk.http.cookies.set("lubdub-desk", seen[1])
    assert desk.http.get("/desk").url.path == "/desk/sign-in"


def test_the_desks_cookie_is_bound_to_the_host_and_gone_with_the_browser() -> None:
    plain, sealed = (desk_cookie(one, new_visitor()) for one in (Settings(), Settings(behind_tls_proxy=True)))
    assert plain.startswith("lubdub-desk=")
    assert sealed.startswith("__Host-lubdub-desk=")
    assert sealed.endswith("; Secure")
    assert all("HttpOnly; SameSite=Lax" in cookie and "Max-Age" not in cookie for cookie in (plain, sealed))


@pytest.mark.parametrize("path", ["/desk/sign-out", "/desk/account/sessions/end-others"])
def test_a_form_of_another_site_does_nothing(service: Service, path: str) -> None:
    desk = signed_in(service)
    token = desk.token()
    assert (
        desk.http.post(path, data={"csrf_token": token}, headers={"Origin": "https://evil.example"}).status_code == 403
    )
    assert desk.http.post(path, data={"csrf_token": token}).status_code == 403
    desk.post(path, 403, token="0" * 128)
    desk.post(path, 403, token=signed_in(service).token())
    assert desk.http.get("/desk").url.path == "/desk"


def test_nobody_is_signed_in_by_another_sites_form(service: Service) -> None:
    account, desk = new_account(service), Desk(service)
    fields = {"email": account.clinician.email, "password": PASSWORD, "code": account.code}
    strange = Desk(service).token("/desk/sign-in")
    desk.get("/desk/sign-in")
    desk.post("/desk/sign-in", 403, token=strange, **fields)


def test_sessions_are_listed_and_ended_one_by_one_or_all_others(service: Service) -> None:
    account = new_account(service)
    here, there = Desk(service), Desk(service)
    sign_in(here, account)
    there.http.headers["User-Agent"] = "The other browser"
    sign_in(there, account, code=account.codes[0])
    page = here.get("/desk/account")
    assert "The other browser" in page
    assert "python-httpx" in page
    here.post("/desk/account/sessions/end-others")
    assert there.http.get("/desk").url.path == "/desk/sign-in"
    mine = hidden(here.get("/desk/account"), "session")
    stranger = signed_in(service)
    stranger.post("/desk/account/sessions/end", session=mine)
    assert here.http.get("/desk").url.path == "/desk"
    here.post("/desk/account/sessions/end", session=mine)
    assert here.http.get("/desk").url.path == "/desk/sign-in"


@pytest.mark.parametrize(
    ("said", "known"),
    [
        (
            "Mozilla/5.0 (iPad; CPU OS 18_0 like Mac OS X) AppleWebKit/605 (KHTML, like Gecko) Safari/604.1",
            "Safari, iPad",
        ),
        ("Mozilla/5.0 (Windows NT 10.0; Win64) AppleWebKit/537 Chrome/140.0 Safari/537 Edg/140.0", "Edge, Windows"),
        ("Mozilla/5.0 (X11; Linux x86_64; rv:140.0) Gecko/20100101 Firefox/140.0", "Firefox, Linux"),
        ("curl/8", "curl/8"),
        ("", ""),
    ],
)
def test_a_browser_is_named_as_its_owner_knows_it(said: str, known: str) -> None:
    headers = [(b"user-agent", said.encode())]
    assert device_of(Request({"type": "http", "headers": headers})) == known


def test_the_first_link_makes_the_administrator_and_an_organisation(service: Service, empty: Settings) -> None:
    newcomer = Service(empty)
    try:
        newcomer.start_web()
        offered = first_link(empty.database)
        assert offered is not None
        desk = Desk(newcomer)
        opening = {"token": desk.token("/desk/join"), "link": offered.token}
        page = desk.post("/desk/join", **opening).text
        secret = hidden(page, "secret")
        said = {
            **opening,
            "secret": secret,
            "name": "Ada",
            "email": "ada@heart.example",
            "organisation": "Heart House",
            "password": PASSWORD,
            "code": code_at(secret, time.time()),
        }
        for field, wrong in (
            ("password", "short"),
            ("password", "password1234"),
            ("password", "Ada at Heart House"),
            ("code", "000000"),
            ("email", "ada"),
            ("name", " "),
            ("organisation", ""),
        ):
            again = desk.post("/desk/join/password", 422, **said | {field: wrong}).text
            assert f'href="#{field}"' in again
            assert hidden(again, "secret") == secret
        page = desk.post("/desk/join/password", **said).text
        assert page.count("<li>") == 8
        assert "Heart House" in desk.get("/desk")
        assert first_link(empty.database) is None
        late = Desk(newcomer)
        opening = {"token": late.token("/desk/join"), "link": offered.token}
        assert "does not work" in late.post("/desk/join", 422, **opening).text
        assert offered.token not in newcomer.log.read_text()
    finally:
        newcomer.stop()


def test_visiting_a_link_does_not_use_it_up(service: Service) -> None:
    ada = signed_in(service, "administrator")
    assert ada.session is not None
    with staff_of(service.settings) as (staff, _database):
        link = staff.invitations.offer(ada.session.actor, "lead").token
        for _ in range(2):
            visitor = Desk(service)
            visitor.get("/desk/join")
            visitor.get(f"/desk/join?link={link}")
            page = visitor.post("/desk/join", token=visitor.token("/desk/join"), link=link).text
        assert "Heart House" in page
        assert "Lead" in page
        assert staff.invitations.look(link) is not None


@pytest.mark.parametrize("role", ROLES)
def test_a_role_opens_what_it_may_and_sockets_are_refused_with_a_status(role: Role, empty: Settings) -> None:
    app = FastAPI()
    app.state.services = open_services(empty)
    install_problems(app)

    @app.get("/lead")
    def lead(session: LeadDep) -> str:
        return session.clinician.role

    @app.get("/administrator")
    def administrator(session: AdministratorDep) -> str:
        return session.clinician.role

    @app.websocket("/desk/socket")
    async def socket(websocket: WebSocket, session: ClinicianDep) -> None:
        await websocket.accept()
        await websocket.send_text(session.clinician.role)
        await websocket.close()

    service = Service(empty)
    client = TestClient(app)
    with pytest.raises(WebSocketDenialResponse) as refused, client.websocket_connect("/desk/socket"):
        pass
    assert refused.value.status_code == 401
    session = signed_in(service, role).session
    assert session is not None
    client.cookies.set("lubdub-desk", session.token)
    statuses = [client.get(path).status_code for path in ("/lead", "/administrator")]
    assert statuses == {"clinician": [403, 403], "lead": [200, 403], "administrator": [200, 200]}[role]
    with client.websocket_connect("/desk/socket") as opened:
        assert opened.receive_text() == role
    app.state.services.close()
