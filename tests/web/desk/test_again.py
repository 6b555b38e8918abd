"""Changing how one signs in asks who one is, anew; and then leads back."""

from __future__ import annotations

import time
from urllib.parse import parse_qs, urlsplit

import pytest

from lubdub.cases.credentials import code_at
from tests.web.desk.test_desk import sign_in
from tests.web.service import Service
from tests.web.staff import PASSWORD, Account, Desk, grow_old, hidden, new_account

CHANGES = {
    "POST /desk/account/passkeys/options": "/desk/account",
    "POST /desk/account/passkeys": "/desk/account",
    "POST /desk/account/passkeys/remove": "/desk/account",
    "GET /desk/account/password": "/desk/account/password",
    "POST /desk/account/password": "/desk/account",
    "POST /desk/people/invite": "/desk/people",
    "POST /desk/people/renew": "/desk/people",
}
"""Each call that changes how one, or somebody else, signs in -> the page to which signing in again leads back."""


def long_signed_in(service: Service) -> tuple[Desk, Account]:
    """A browser in which somebody signed in a little too long ago."""
    account, desk = new_account(service, "administrator"), Desk(service)
    sign_in(desk, account, code=account.codes[0])
    grow_old(service, account.clinician)
    desk.http.follow_redirects = False
    return desk, account


def test_every_change_of_how_one_signs_in_asks_for_signing_in_again(service: Service) -> None:
    desk, _account = long_signed_in(service)
    headers = {"X-CSRF-Token": desk.token(), "Origin": service.settings.address}
    for call, back in CHANGES.items():
        method, path = call.split()
        answer = desk.http.request(method, path, headers=headers)
        assert answer.status_code == 303, call
        where = urlsplit(answer.headers["location"])
        assert (where.path, parse_qs(where.query)) == ("/desk/sign-in", {"again": ["1"], "back": [back]})
        told = desk.http.request(method, path, headers={**headers, "Accept": "application/json"})
        assert (told.status_code, told.json()["type"]) == (403, "/problems/sign-in-again")
    desk.get("/desk/account")
    desk.get("/desk")


def test_signing_in_again_leads_back_and_ends_the_session_of_before(service: Service) -> None:
    desk, account = long_signed_in(service)
    desk.http.follow_redirects = True
    page = desk.get("/desk/account/password")
    assert "Sign in once more" in page
    old = desk.http.cookies["lubdub-desk"]
    fields = {"email": account.clinician.email, "password": PASSWORD, "code": account.codes[1]}
    again = desk.post("/desk/sign-in", token=hidden(page, "csrf_token"), back=hidden(page, "back"), **fields)
    assert again.url.path == "/desk/account/password"
    secret = hidden(again.text, "secret")
    said = {"current": PASSWORD, "password": "another three words", "code": code_at(secret, time.time())}
    assert desk.post("/desk/account/password", secret=secret, **said).text.count("<li>") == 8
    desk.http.cookies.set("lubdub-desk", old)
    assert desk.http.get("/desk").url.path == "/desk/sign-in"


@pytest.mark.parametrize("query", ["", "&again=1"])
def test_who_signed_in_just_now_is_not_asked_again(service: Service, query: str) -> None:
    account, desk = new_account(service), Desk(service)
    sign_in(desk, account)
    assert desk.http.get(f"/desk/sign-in?back=/desk/account{query}").url.path == "/desk/account"
    assert "New password" in desk.get("/desk/account/password")
