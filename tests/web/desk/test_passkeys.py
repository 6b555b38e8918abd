"""Passkeys at the desk: an account is made and opened with one, and nothing that is not quite it opens anything."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx
import pytest

from lubdub.settings import Settings
from lubdub.web.passkey_ceremony import relying_party
from tests.web.authenticator import USER_PRESENT, Authenticator
from tests.web.service import Service
from tests.web.staff import Desk, new_account, signed_in, staff_of


def ask(desk: Desk, path: str, expect: int = 200, **body: Any) -> dict[str, Any]:
    answer = call(desk, path, **body)
    assert answer.status_code == expect, answer.text
    return dict(answer.json())


def call(desk: Desk, path: str, **body: Any) -> httpx.Response:
    is_in = desk.session is not None
    headers = {
        "X-CSRF-Token": desk.token("/desk/account" if is_in else "/desk/sign-in"),
        "Origin": desk.service.settings.address,
        "Accept": "application/json",
    }
    return desk.http.post(path, json=body, headers=headers)


def passkey(service: Service) -> Authenticator:
    return Authenticator(*relying_party(service.settings))


def joined(service: Service, email: str) -> tuple[Authenticator, Desk]:
    """An account made with a passkey."""
    of = new_account(service, "administrator").clinician
    with staff_of(service.settings) as (staff, _database):
        link = staff.invitations.offer(of.actor, "lead").token
    desk, key = Desk(service), passkey(service)
    said = {"link": link, "name": "Bo", "email": email}
    options = ask(desk, "/desk/join/passkey/options", **said)
    assert ask(desk, "/desk/join/passkey", **said, credential=key.make(options)) == {"next": "/desk"}
    return key, desk


def test_an_account_is_made_and_opened_with_a_passkey_alone(service: Service) -> None:
    key, desk = joined(service, "bo@passkey.example")
    assert "Bo" in desk.get("/desk")
    other = Desk(service)
    options = ask(other, "/desk/sign-in/passkey/options")
    assert options["userVerification"] == "required"
    assert (
        ask(other, "/desk/sign-in/passkey", credential=key.use(options), back="/desk/account")["next"]
        == "/desk/account"
    )
    assert "Bo" in other.get("/desk")


def test_what_was_signed_once_opens_nothing_twice_nor_elsewhere(service: Service) -> None:
    key, _ = joined(service, "cy@passkey.example")
    desk, thief = Desk(service), Desk(service)
    credential = key.use(ask(desk, "/desk/sign-in/passkey/options"))
    ask(thief, "/desk/sign-in/passkey", 401, credential=credential)
    ask(thief, "/desk/sign-in/passkey/options")
    ask(thief, "/desk/sign-in/passkey", 401, credential=credential)
    ask(desk, "/desk/sign-in/passkey", credential=credential)
    ask(Desk(service), "/desk/sign-in/passkey", 401, credential=credential)


LIES: dict[str, Callable[[Authenticator], Any]] = {
    "another site's page": lambda key: setattr(key, "origin", "https://evil.example"),
    "another site's key": lambda key: setattr(key, "site", "evil.example"),
    "nobody touched it": lambda key: setattr(key, "flags", 0),
    "no finger, face or PIN": lambda key: setattr(key, "flags", USER_PRESENT),
    "a key nobody knows": lambda key: setattr(key, "credential_id", b"another"),
    "another's signature": lambda key: setattr(key, "key", Authenticator("", "").key),
}


@pytest.mark.parametrize("lie", LIES)
def test_a_passkey_that_lies_opens_nothing(service: Service, lie: str) -> None:
    key, _ = joined(service, f"lie-{len(lie)}-{lie[-4:]}@passkey.example".replace(" ", ""))
    LIES[lie](key)
    desk = Desk(service)
    ask(desk, "/desk/sign-in/passkey", 401, credential=key.use(ask(desk, "/desk/sign-in/passkey/options")))
    assert desk.http.get("/desk").url.path == "/desk/sign-in"


@pytest.mark.parametrize("credential", [{}, {"id": "é"}, {"id": [1]}, {"id": "AAAA", "response": 7}])
def test_what_is_no_passkey_at_all_is_refused_in_words(service: Service, credential: dict[str, Any]) -> None:
    desk = Desk(service)
    ask(desk, "/desk/sign-in/passkey/options")
    assert ask(desk, "/desk/sign-in/passkey", 401, credential=credential)["detail"]


def test_joining_says_what_is_missing_and_a_spent_link(service: Service) -> None:
    of = new_account(service, "administrator").clinician
    with staff_of(service.settings) as (staff, _database):
        link = staff.invitations.offer(of.actor, "lead").token
    desk = Desk(service)
    assert set(ask(desk, "/desk/join/passkey/options", 422, link=link)["errors"]) == {"name", "email"}
    assert set(ask(desk, "/desk/join/passkey/options", 422, link="guess")["errors"]) == {"link"}
    said = {"link": link, "name": "Bo", "email": of.email}
    made = passkey(service).make(ask(desk, "/desk/join/passkey/options", **said))
    assert set(ask(desk, "/desk/join/passkey", 422, **said, credential=made)["errors"]) == {"email"}


def test_passkeys_are_added_and_removed_but_never_the_last_way_in(service: Service) -> None:
    key, desk = joined(service, "di@passkey.example")
    with staff_of(service.settings) as (staff, _database):
        who = staff.clinicians.find("di@passkey.example")
        assert who is not None
        first = staff.passkeys.list_of(who)[0].id
        desk.session = staff.sessions.open(who, "passkey", "test")
        desk.http.cookies.set("lubdub-desk", desk.session.token)
        desk.post("/desk/account/passkeys/remove", 409, passkey=first)
        options = ask(desk, "/desk/account/passkeys/options")
        assert len(options["excludeCredentials"]) == 1
        ask(desk, "/desk/account/passkeys", credential=passkey(service).make(options))
        signed_in(service).post("/desk/account/passkeys/remove", passkey=first)
        assert len(staff.passkeys.list_of(who)) == 2
        desk.post("/desk/account/passkeys/remove", passkey=first)
    other = Desk(service)
    ask(other, "/desk/sign-in/passkey", 401, credential=key.use(ask(other, "/desk/sign-in/passkey/options")))


def test_a_script_of_another_site_makes_no_passkey(service: Service) -> None:
    desk = signed_in(service)
    headers = {"Origin": "https://evil.example", "X-CSRF-Token": desk.token()}
    assert desk.http.post("/desk/account/passkeys/options", json={}, headers=headers).status_code == 403
    headers = {"Origin": service.settings.address, "Accept": "application/json"}
    assert desk.http.post("/desk/account/passkeys/options", json={}, headers=headers).status_code == 403


def test_passkeys_are_bound_to_a_name_never_to_a_number() -> None:
    assert relying_party(Settings()) == ("localhost", "http://localhost:8000")
    public = Settings(public_url="https://desk.example/")
    assert relying_party(public) == ("desk.example", "https://desk.example")
