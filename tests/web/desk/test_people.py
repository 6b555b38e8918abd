"""People of an organisation: invited, given roles, shut out, given new ways to sign in, by an administrator alone."""

from __future__ import annotations

import html
import re
import time

import httpx
import pytest

from lubdub.cases.credentials import code_at
from tests.web.desk.test_desk import sign_in
from tests.web.service import Service
from tests.web.staff import PASSWORD, Account, Desk, hidden, new_account, signed_in


def link_in(page: httpx.Response) -> str:
    found = re.search(r'id="link">http://localhost:\d+/desk/join#([\w-]{43})<', page.text)
    assert found is not None
    return found.group(1)


def test_a_colleague_is_invited_joins_and_is_shut_out(service: Service) -> None:
    ada = signed_in(service, "administrator", "People House")
    link = link_in(ada.post("/desk/people/invite", role="lead"))
    assert link not in ada.get("/desk/people")
    bo = Desk(service)
    opening = {"token": bo.token("/desk/join"), "link": link}
    secret = hidden(bo.post("/desk/join", **opening).text, "secret")
    said = {"name": "Bo <b>", "email": "bo@people.example", "password": PASSWORD}
    bo.post("/desk/join/password", **opening, secret=secret, code=code_at(secret, time.time()), **said)
    page = ada.get("/desk/people")
    assert html.escape("Bo <b>") in page
    assert "Open links" not in page
    (other,) = set(re.findall(r'name="clinician" value="(\w+)"', page)) - {me(ada)}
    ada.post("/desk/people/role", clinician=other, role="administrator")
    bo.get("/desk/people")
    ada.post("/desk/people/disable", clinician=other)
    assert bo.http.get("/desk").url.path == "/desk/sign-in"
    ada.post("/desk/people/enable", clinician=other)


def test_a_link_can_be_taken_back(service: Service) -> None:
    ada = signed_in(service, "administrator", "Back House")
    link = link_in(ada.post("/desk/people/invite", role="clinician"))
    ada.post("/desk/people/uninvite", invitation=hidden(ada.get("/desk/people"), "invitation"))
    late = Desk(service)
    late.post("/desk/join", 422, token=late.token("/desk/join"), link=link)


def test_who_lost_the_phone_gets_new_ways_to_sign_in_and_old_ones_are_over(service: Service) -> None:
    ada, lost = signed_in(service, "administrator", "Lost House"), new_account(service, "lead", "Lost House")
    old = Desk(service)
    sign_in(old, lost)
    link = link_in(ada.post("/desk/people/renew", clinician=lost.clinician.id))
    new = Desk(service)
    opening = {"token": new.token("/desk/join"), "link": link}
    page = new.post("/desk/join", **opening).text
    assert lost.clinician.email in page
    secret = hidden(page, "secret")
    code = code_at(secret, time.time())
    new.post("/desk/join/password", **opening, secret=secret, code=code, password="another three words")
    assert old.http.get("/desk").url.path == "/desk/sign-in"
    sign_in(Desk(service), lost, 422, code=lost.codes[0])
    renewed = Account(lost.clinician, secret, [])
    later = Desk(service)
    sign_in(later, renewed, password="another three words")
    assert "Lead" in later.get("/desk/account")


def test_a_password_is_replaced_by_whoever_is_signed_in_and_knows_it(service: Service) -> None:
    desk = signed_in(service)
    page = desk.get("/desk/account/password")
    secret = hidden(page, "secret")
    assert 'type="password" value="" autocomplete="current-password"' in page
    said = {"secret": secret, "current": PASSWORD, "password": "another three words"}
    for field, wrong in (
        ("code", "000000"),
        ("current", "three plain worms"),
        ("current", ""),
        ("password", "Heart House"),
    ):
        fields = {"code": code_at(secret, time.time())} | said | {field: wrong}
        assert f'href="#{field}"' in desk.post("/desk/account/password", 422, **fields).text
    page = desk.post("/desk/account/password", **said, code=code_at(secret, time.time())).text
    assert page.count("<li>") == 8


@pytest.mark.parametrize("verb", ["role", "disable", "enable", "renew"])
def test_people_of_another_organisation_cannot_be_touched(service: Service, verb: str) -> None:
    ada, stranger = signed_in(service, "administrator", "Own House"), new_account(service, "lead", "Other House")
    ada.post(f"/desk/people/{verb}", 409, clinician=stranger.clinician.id, role="lead")
    ada.post("/desk/people/role", 400, clinician=stranger.clinician.id, role="king")


def test_the_last_administrator_stays(service: Service) -> None:
    ada = signed_in(service, "administrator", "Sole House")
    ada.post("/desk/people/disable", 409, clinician=me(ada))
    ada.post("/desk/people/role", 409, clinician=me(ada), role="lead")


def me(desk: Desk) -> str:
    assert desk.session is not None
    return desk.session.clinician.id
