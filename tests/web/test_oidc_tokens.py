"""The token of an organisation's login counts when every word of it fits, and its signature; else nobody is let in."""

from __future__ import annotations

import base64
import json
import time
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from joserfc import jwt
from joserfc.jwk import ECKey, OctKey

from lubdub.cases.errors import SignInRefused
from lubdub.settings import Settings
from lubdub.web import oidc
from lubdub.web.oidc import Finished, Login
from lubdub.web.problems import Problem

ISSUER = "https://login.example"
KEY = ECKey.generate_key("P-256", {"kid": "one", "use": "sig"})
STRANGER = ECKey.generate_key("P-256", {"kid": "one", "use": "sig"})
SETTINGS = Settings(oidc_issuer=ISSUER, oidc_client_id="lubdub", oidc_client_secret="x")  # type: ignore[arg-type]
DISCOVERY = {
    "issuer": ISSUER,
    "authorization_endpoint": f"{ISSUER}/authorize",
    "token_endpoint": f"{ISSUER}/token",
    "jwks_uri": f"{ISSUER}/keys",
}


class Provider:
    """A login that answers what a test says, without a network."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.discovery: dict[str, Any] = dict(DISCOVERY)
        self.header: dict[str, Any] = {"alg": "ES256", "kid": "one"}
        self.key: Any = KEY
        self.token: str | None = None
        self.challenge = b"c" * 32
        monkeypatch.setattr(oidc, "_call", self.call)

    def call(self, method: str, address: str, **more: Any) -> dict[str, Any]:
        if address.endswith("openid-configuration"):
            return self.discovery
        if address == DISCOVERY["jwks_uri"]:
            return {"keys": [KEY.as_dict(private=False)]}
        assert (method, address) == ("POST", DISCOVERY["token_endpoint"])
        return {"id_token": self.token or jwt.encode(self.header, self.claims, self.key, algorithms=["ES256", "HS256"])}

    def sign_in(self, must_ask: bool = False, **changes: Any) -> Finished:
        login = Login(SETTINGS, self.challenge)
        asked = {key: one[0] for key, one in parse_qs(urlsplit(login.address("/desk", must_ask)).query).items()}
        moment = int(time.time())
        claims = {
            "iss": ISSUER,
            "sub": "7",
            "aud": "lubdub",
            "iat": moment,
            "exp": moment + 300,
            "nonce": asked["nonce"],
            "email": "ada@heart.example",
            "email_verified": True,
        } | changes
        self.claims = {name: one for name, one in claims.items() if one is not None}
        return login.finish({"state": asked["state"], "code": "code"})


@pytest.fixture
def provider(monkeypatch: pytest.MonkeyPatch) -> Provider:
    return Provider(monkeypatch)


def test_a_token_that_fits_says_who_it_is(provider: Provider) -> None:
    done = provider.sign_in()
    assert (done.vouched.issuer, done.vouched.subject, done.vouched.email) == (ISSUER, "7", "ada@heart.example")
    assert provider.sign_in(aud=["lubdub"]) == done
    assert provider.sign_in(email_verified=False).vouched.email == ""


WRONG: dict[str, dict[str, Any]] = {
    "for another service": {"aud": "another"},
    "for nobody": {"aud": None},
    "of another login": {"iss": "https://evil.example"},
    "of nobody": {"iss": None},
    "over": {"exp": int(time.time()) - oidc.LEEWAY_S - 5},
    "for ever": {"exp": None},
    "not yet": {"nbf": int(time.time()) + 3600},
    "about nobody": {"sub": None},
    "of another try": {"nonce": "another"},
    "without a nonce": {"nonce": None},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_token_that_is_not_quite_for_us_here_and_now_opens_nothing(provider: Provider, wrong: str) -> None:
    with pytest.raises(SignInRefused):
        provider.sign_in(**WRONG[wrong])


def test_a_signature_of_another_key_opens_nothing(provider: Provider) -> None:
    provider.key = STRANGER
    with pytest.raises(SignInRefused):
        provider.sign_in()


@pytest.mark.parametrize("algorithm", ["none", "HS256"])
def test_no_token_without_a_signature_or_with_one_that_anybody_can_make_is_taken(
    provider: Provider, algorithm: str
) -> None:
    provider.sign_in()
    public = json.dumps(KEY.as_dict(private=False)).encode()
    if algorithm == "HS256":
        provider.header, provider.key = {"alg": "HS256", "kid": "one"}, OctKey.import_key(public)
    else:
        head, body = (json.dumps(part).encode() for part in ({"alg": "none"}, provider.claims))
        provider.token = ".".join(base64.urlsafe_b64encode(part).rstrip(b"=").decode() for part in (head, body)) + "."
    with pytest.raises(SignInRefused):
        provider.sign_in()


def test_signatures_are_taken_of_a_list_of_public_key_algorithms() -> None:
    assert set(oidc.ALGORITHMS) == {"RS256", "PS256", "ES256", "EdDSA"}


def test_an_access_token_is_no_word_about_a_person(provider: Provider) -> None:
    with pytest.raises(SignInRefused):
        provider.sign_in(nonce=None, scope="openid email", token_use="access")


def test_a_login_that_calls_itself_by_another_name_is_not_asked(provider: Provider) -> None:
    provider.discovery["issuer"] = "https://evil.example"
    with pytest.raises(Problem, match="another one"):
        provider.sign_in()


@pytest.mark.parametrize("state", ["", ".", "x.y", "Nw.x", "é.x"])
def test_a_state_that_we_did_not_make_ends_there(provider: Provider, state: str) -> None:
    with pytest.raises(SignInRefused):
        Login(SETTINGS, provider.challenge).finish({"state": state, "code": "code"})


def test_a_state_cannot_be_bent_to_another_page_or_to_having_been_asked(provider: Provider) -> None:
    login = Login(SETTINGS, provider.challenge)
    real = parse_qs(urlsplit(login.address("/desk", False)).query)["state"][0]
    for packed in (["/desk/people", False], ["/desk", True]):
        bent = base64.urlsafe_b64encode(json.dumps(packed).encode()).rstrip(b"=").decode()
        with pytest.raises(SignInRefused):
            login.finish({"state": f"{bent}.{real.partition('.')[2]}", "code": "code"})


@pytest.mark.parametrize(
    "auth_time",
    [None, "now", int(time.time()) - 3600, int(time.time()) + 3600],
    ids=["nothing", "a word", "an hour ago", "in an hour"],  # the numbers would differ between processes
)
def test_having_asked_the_person_just_now_must_be_said_by_the_login(provider: Provider, auth_time: Any) -> None:
    with pytest.raises(SignInRefused):
        provider.sign_in(must_ask=True, auth_time=auth_time)
    assert provider.sign_in(must_ask=True, auth_time=int(time.time())).was_asked
    assert not provider.sign_in(auth_time=auth_time if isinstance(auth_time, int) else None).was_asked
