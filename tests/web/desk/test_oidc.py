"""Signing in by an organisation's own login: a real provider in a process of its own, and every way to cheat it."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from pydantic import ValidationError

from lubdub.settings import Settings
from tests.web.service import Service, eventually, free_port
from tests.web.staff import Account, Desk, new_account, staff_of


@pytest.fixture(scope="module")
def provider() -> Iterator[str]:
    """The address of a login, at which anybody is whoever they say."""
    port = free_port()
    process = subprocess.Popen(
        [sys.executable, "-m", "oidc_provider_mock", "--port", str(port)], stderr=subprocess.DEVNULL
    )
    issuer = f"http://127.0.0.1:{port}"
    try:
        eventually(lambda: answers(f"{issuer}/.well-known/openid-configuration"))
        yield issuer
    finally:
        process.terminate()
        process.wait(10)


def answers(address: str) -> bool:
    try:
        return httpx.get(address).status_code == 200
    except httpx.TransportError:
        return False


@pytest.fixture(scope="module")
def hospital(provider: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service whose clinicians sign in there."""
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("hospital") / "data",
        port=free_port(),
        oidc_issuer=provider,
        oidc_client_id="lubdub",
        oidc_client_secret="eleven geese in a row",  # type: ignore[arg-type]
        oidc_name="Heart House login",
    )
    running = Service(settings)
    try:
        running.start_web()
        yield running
    finally:
        running.stop()


@pytest.fixture
def account(hospital: Service) -> Account:
    return new_account(hospital)


def at(service: Service) -> Desk:
    """A browser at the address that the login knows."""
    desk = Desk(service)
    desk.http.base_url = httpx.URL(service.settings.desk_address)
    desk.http.follow_redirects = False
    return desk


def vouched(
    provider: str, desk: Desk, account: Account, way: str = "/desk/oidc", sub: str = "", **changes: object
) -> str:
    """Through the login, which vouches for the account's address; where it sends the browser."""
    sub = sub or account.clinician.id
    claims = {"email": account.clinician.email, "email_verified": True} | changes
    httpx.put(f"{provider}/users/{sub}", json=claims).raise_for_status()
    asked = desk.http.get(way).headers["location"]
    assert asked.startswith(provider)
    answer = httpx.post(asked, data={"sub": sub})
    assert answer.status_code == 302, answer.text
    return answer.headers["location"]


def is_in(desk: Desk) -> bool:
    return desk.http.get("/desk").status_code == 200


def test_who_has_an_account_is_signed_in_by_the_login(hospital: Service, provider: str, account: Account) -> None:
    desk = at(hospital)
    assert "Sign in with Heart House login" in desk.get("/desk/sign-in")
    back = vouched(provider, desk, account)
    assert back.startswith(f"{hospital.settings.desk_address}/desk/oidc/callback?")
    assert desk.http.get(back).headers["location"] == "/desk"
    assert account.clinician.name in desk.get("/desk")
    desk.http.cookies.clear()
    assert not is_in(desk)


def test_the_way_there_is_guarded_by_state_nonce_and_a_proof_of_the_browser(hospital: Service) -> None:
    first, second = (
        parse_qs(urlsplit(at(hospital).http.get("/desk/oidc").headers["location"]).query) for _ in range(2)
    )
    assert first["code_challenge_method"] == ["S256"]
    for guard in ("state", "nonce", "code_challenge"):
        assert first[guard] != second[guard]


def test_what_one_browser_began_no_other_finishes_and_nobody_twice(
    hospital: Service, provider: str, account: Account
) -> None:
    desk, thief = at(hospital), at(hospital)
    back = vouched(provider, desk, account)
    thief.http.get("/desk/oidc")
    thief.http.get(back)
    assert not is_in(thief)
    desk.http.get(back.replace("state=", "state=x"))
    desk.http.get(back)
    assert not is_in(desk)


def test_the_login_leads_back_to_the_page_that_was_wanted(hospital: Service, provider: str, account: Account) -> None:
    desk = at(hospital)
    back = vouched(provider, desk, account, way="/desk/oidc?back=/desk/account")
    assert desk.http.get(back).headers["location"] == "/desk/account"
    astray = vouched(provider, at(hospital), account, way="/desk/oidc?back=//evil.example")
    assert "evil" not in astray


def test_a_login_that_may_remember_people_must_ask_before_one_changes_how_one_signs_in(
    hospital: Service, provider: str, account: Account
) -> None:
    desk = at(hospital)
    desk.http.get(vouched(provider, desk, account))
    on = desk.http.get("/desk/account/password").headers["location"]
    assert "again=1" in on
    way = html.unescape(re.findall(r'href="(/desk/oidc[^"]+)"', desk.get(on))[0])
    asked = parse_qs(urlsplit(desk.http.get(way).headers["location"]).query)
    assert (asked["prompt"], asked["max_age"]) == (["login"], ["0"])
    done = desk.http.get(vouched(provider, desk, account, way=way))
    assert done.headers["location"] == "/desk/account/password"
    assert desk.http.get("/desk/account/password").status_code == 200


def test_the_account_stays_with_the_person_whom_the_login_meant_first(
    hospital: Service, provider: str, account: Account
) -> None:
    desk, heir = at(hospital), at(hospital)
    desk.http.get(vouched(provider, desk, account))
    assert is_in(desk)
    heir.http.get(vouched(provider, heir, account, sub="the next one with that address"))
    assert not is_in(heir)
    later = at(hospital)
    later.http.get(vouched(provider, later, account, email="new@heart.example", email_verified=False))
    assert is_in(later)


@pytest.mark.parametrize("changes", [{"email": "nobody@heart.example"}, {"email_verified": False}])
def test_an_address_that_is_unknown_or_not_vouched_for_opens_nothing(
    hospital: Service, provider: str, account: Account, changes: dict[str, object]
) -> None:
    desk = at(hospital)
    answer = desk.http.get(vouched(provider, desk, account, **changes))
    assert (answer.status_code, "opens no account here" in answer.text) == (422, True)
    assert not is_in(desk)


def test_who_was_shut_out_stays_out(hospital: Service, provider: str, account: Account) -> None:
    with staff_of(hospital.settings) as (staff, _database):
        new_account(hospital, "administrator")
        staff.clinicians.disable(account.clinician.actor, account.clinician.id)
    desk = at(hospital)
    desk.http.get(vouched(provider, desk, account))
    assert not is_in(desk)


def test_without_such_a_login_there_is_no_such_way(service: Service) -> None:
    desk = Desk(service)
    assert "/desk/oidc" not in desk.get("/desk/sign-in")
    desk.get("/desk/oidc", 404)


def test_the_secret_is_told_to_nobody() -> None:
    settings = Settings(oidc_client_secret="hush")  # type: ignore[arg-type]
    assert "hush" not in str(settings) + json.dumps(settings.model_dump(mode="json"))


@pytest.mark.parametrize(
    "wrong", [{"oidc_issuer": "http://login.example", "oidc_client_id": "x"}, {"oidc_issuer": "https://login.example"}]
)
def test_a_login_that_anybody_could_forge_is_refused_in_words(wrong: dict[str, str]) -> None:
    with pytest.raises(ValidationError, match="LUBDUB_OIDC"):
        Settings(**wrong)
