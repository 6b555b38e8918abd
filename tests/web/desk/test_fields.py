"""What the desk's pages ask for, and how: a password is a password's field, and the way out is on every page."""

from __future__ import annotations

import re

import pytest

from tests.web.service import Service
from tests.web.staff import Desk, signed_in, staff_of

PAGES = ("/desk", "/desk/account", "/desk/account/password", "/desk/families", "/desk/references", "/desk/audit")
PAGES += ("/desk/holds", "/desk/people")


@pytest.fixture(scope="module")
def ada(service: Service) -> Desk:
    """An administrator, who sees every page."""
    return signed_in(service, "administrator", "Field House")


@pytest.fixture(scope="module")
def forms(service: Service, ada: Desk) -> dict[str, str]:
    """The pages on which a password is typed."""
    assert ada.session is not None
    with staff_of(service.settings) as (staff, _database):
        link = staff.invitations.offer(ada.session.actor, "lead").token
    newcomer = Desk(service)
    return {
        "sign-in": newcomer.get("/desk/sign-in"),
        "join": newcomer.post("/desk/join", token=newcomer.token("/desk/join"), link=link).text,
        "password": ada.get("/desk/account/password"),
    }


def fields(page: str) -> dict[str, str]:
    """Every field of the page's forms: name -> its tag."""
    return {re.findall(r'name="(\w+)"', tag)[0]: tag for tag in re.findall(r"<input\b[^>]*>", page) if "name=" in tag}


ASKED = {
    "sign-in": {"password": "current-password"},
    "join": {"password": "new-password"},
    "password": {"password": "new-password", "current": "current-password"},
}


@pytest.mark.parametrize("page", ASKED)
def test_a_password_is_hidden_while_typed_and_known_to_password_managers(forms: dict[str, str], page: str) -> None:
    found = fields(forms[page])
    for name, kind in ASKED[page].items():
        assert 'type="password"' in found[name]
        assert f'autocomplete="{kind}"' in found[name]
    assert {name for name, tag in found.items() if 'type="password"' in tag} == set(ASKED[page])


@pytest.mark.parametrize("page", ASKED)
def test_a_password_may_be_pasted_and_is_not_cut(forms: dict[str, str], page: str) -> None:
    for name in ASKED[page]:
        assert not re.search(r"maxlength|minlength|pattern|onpaste|oncopy|readonly|disabled", fields(forms[page])[name])


def test_nobody_is_asked_for_a_secret_question_or_a_hint(forms: dict[str, str]) -> None:
    asked = {name for page in forms.values() for name in fields(page)}
    known = {"csrf_token", "link", "name", "email", "password", "current", "secret", "code", "back"}
    assert asked == known


@pytest.mark.parametrize("page", PAGES)
def test_the_way_out_is_on_every_page_of_the_desk(ada: Desk, page: str) -> None:
    assert '<form method="post" action="/desk/sign-out">' in ada.get(page)


def test_signing_out_clears_what_the_browser_keeps_of_us(service: Service) -> None:
    desk = signed_in(service)
    desk.http.follow_redirects = False
    answer = desk.post("/desk/sign-out", 303)
    assert answer.headers["clear-site-data"] == '"storage"'
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["location"] == "/desk/sign-in"


def test_a_value_in_the_address_does_not_stand_in_for_a_forms_field(service: Service) -> None:
    desk = Desk(service)
    token = desk.token("/desk/sign-in")
    again = desk.post("/desk/sign-in?email=ada@heart.example&password=three+plain+words&code=1", 422, token=token)
    assert "ada@heart.example" not in fields(again.text)["email"]
    headers = {"Origin": service.settings.address}
    assert desk.http.post(f"/desk/sign-in?csrf_token={token}", data={}, headers=headers).status_code == 403
