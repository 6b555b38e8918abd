"""Signing in by an organisation's own login (OpenID Connect, authorization code with PKCE), named in the settings."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

import httpx
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet

from lubdub.cases.desk_values import Vouched
from lubdub.cases.errors import SignInRefused
from lubdub.cases.passkeys import CHALLENGE_LASTS
from lubdub.settings import Settings
from lubdub.web.problems import Problem

CALLBACK = "/desk/oidc/callback"
ALGORITHMS = ["RS256", "PS256", "ES256", "EdDSA"]
"""No symmetric ones, and never `none`."""
TIMEOUT_S = 10.0
LEEWAY_S = 60


@dataclass(frozen=True)
class Provider:
    """What the provider's discovery document says of it."""

    authorization: str
    token: str
    keys: str


@dataclass(frozen=True)
class Finished:
    """What came of one try. back: the page of ours that was wanted; was_asked: the person signed in for this."""

    vouched: Vouched
    back: str
    was_asked: bool


class Login:
    """One way to the provider and back. challenge: random, kept for this browser, and taken once."""

    def __init__(self, settings: Settings, challenge: bytes) -> None:
        """For the provider of the settings."""
        self._issuer = settings.oidc_issuer.rstrip("/")
        self._client_id = settings.oidc_client_id
        self._secret = settings.oidc_client_secret.get_secret_value()
        self._back = f"{settings.desk_address}{CALLBACK}"
        self._challenge = challenge

    def address(self, back: str, must_ask: bool = False) -> str:
        """Where the browser goes to sign in. Raises Problem `not-ready` when the provider does not answer.

        back: the page of ours that is wanted afterwards; must_ask: the provider may not rely on what it remembers.
        """
        query = {
            "response_type": "code",
            "client_id": self._client_id,
            "redirect_uri": self._back,
            "scope": "openid email",
            "state": self._state(back, must_ask),
            "nonce": self._derived("nonce"),
            "code_challenge": _base64(hashlib.sha256(self._derived("verifier").encode()).digest()),
            "code_challenge_method": "S256",
        }
        if must_ask:
            query |= {"prompt": "login", "max_age": "0"}
        return f"{self._discover().authorization}?{urlencode(query)}"

    def finish(self, said: Mapping[str, str]) -> Finished:
        """Whom the provider means. said: the query with which the browser comes back.

        Raises SignInRefused; Problem `not-ready` when the provider does not answer.
        """
        back, was_asked = _unpacked(said.get("state", ""))
        if not hmac.compare_digest(said.get("state", "").encode(), self._state(back, was_asked).encode()):
            raise SignInRefused("state")
        claims = self._claims(said.get("code", ""))
        if was_asked and not _is_recent(claims.get("auth_time")):
            raise SignInRefused("auth_time")
        is_vouched = isinstance(claims.get("email"), str) and claims.get("email_verified") is True
        email = claims["email"] if is_vouched else ""
        return Finished(Vouched(self._issuer, str(claims["sub"]), email), back, was_asked)

    def _state(self, back: str, must_ask: bool) -> str:
        """Known to this browser's try alone, whatever is packed into it."""
        packed = _base64(json.dumps([back, must_ask]).encode())
        return f"{packed}.{self._derived(f'state {packed}')}"

    def _claims(self, code: str) -> dict[str, Any]:
        provider = self._discover()
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": self._back,
            "code_verifier": self._derived("verifier"),
        }
        answer = _call("POST", provider.token, data=form, auth=httpx.BasicAuth(self._client_id, self._secret))
        keys = _call("GET", provider.keys)
        expected = jwt.JWTClaimsRegistry(
            leeway=LEEWAY_S,
            iss={"essential": True, "value": self._issuer},
            aud={"essential": True, "value": self._client_id},
            sub={"essential": True},
            exp={"essential": True},
            nonce={"essential": True, "value": self._derived("nonce")},
        )
        try:
            token = jwt.decode(str(answer["id_token"]), KeySet.import_key_set(keys), algorithms=ALGORITHMS)  # type: ignore[arg-type]
            expected.validate(token.claims)
        except (JoseError, KeyError, ValueError) as error:
            raise SignInRefused("token") from error
        return dict(token.claims)

    def _discover(self) -> Provider:
        told = _call("GET", f"{self._issuer}/.well-known/openid-configuration")
        try:
            if str(told["issuer"]).rstrip("/") != self._issuer:
                raise Problem("not-ready", "The organisation's login says that it is another one.")
            return Provider(told["authorization_endpoint"], told["token_endpoint"], told["jwks_uri"])
        except KeyError as error:
            raise Problem("not-ready", "The organisation's login does not describe itself.") from error

    def _derived(self, purpose: str) -> str:
        return _base64(hmac.digest(self._challenge, purpose.encode(), "sha256"))


def _unpacked(state: str) -> tuple[str, bool]:
    try:
        packed = state.partition(".")[0].encode()
        back, was_asked = json.loads(base64.urlsafe_b64decode(packed + b"=" * (-len(packed) % 4)))
    except (ValueError, TypeError) as error:
        raise SignInRefused("state") from error
    return str(back), bool(was_asked)


def _is_recent(auth_time: Any) -> bool:
    return isinstance(auth_time, int) and abs(time.time() - auth_time) <= CHALLENGE_LASTS.total_seconds()


def _call(method: str, address: str, **more: Any) -> dict[str, Any]:
    """The provider's answer. What it refuses is a refused sign-in; when it fails or is silent, it is not ready."""
    try:
        answer = httpx.request(method, address, timeout=TIMEOUT_S, follow_redirects=False, **more)
        if 400 <= answer.status_code < 500:
            raise SignInRefused(address)
        answer.raise_for_status()
        return dict(answer.json())
    except (httpx.HTTPError, ValueError) as error:
        raise Problem("not-ready", "The organisation's login does not answer. Try again, or sign in here.") from error


def _base64(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()
