"""Who is calling: a portal by its bearer key, a family or a clinician by the browser's session; and no other page
on their behalf.
"""

from __future__ import annotations

import hashlib
import re
import secrets
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection, Request

from lubdub.cases.desk_values import ClinicianSession
from lubdub.cases.people import TOKEN_BYTES
from lubdub.cases.values import FamilySession
from lubdub.settings import Settings
from lubdub.web.problems import Problem

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
CSRF_HEADER = "X-CSRF-Token"
CSRF_FIELD = "csrf_token"


class HasToken(Protocol):
    """A browser's session of any kind."""

    @property
    def token(self) -> str:
        """The secret in its cookie."""


@dataclass(frozen=True)
class Visitor:
    """A browser before signing in at the desk: nothing of it is kept, the cookie only ties its forms to it."""

    token: str


def new_visitor() -> Visitor:
    """A browser that has no cookie of the desk yet."""
    return Visitor(secrets.token_urlsafe(TOKEN_BYTES))


def cookie_name(settings: Settings) -> str:
    """`__Host-` binds the cookie to this very host; browsers demand https for it."""
    return "__Host-lubdub" if settings.is_https else "lubdub"


def embedded_cookie_name(settings: Settings) -> str:
    """Of a session in a portal's frame, so that it never takes the place of a family's own."""
    return f"{cookie_name(settings)}-embedded"


def cookie_names(settings: Settings) -> tuple[str, str]:
    """A family's own, and that of a frame."""
    return cookie_name(settings), embedded_cookie_name(settings)


def session_cookie(settings: Settings, session: FamilySession) -> str:
    """The Set-Cookie header of a session."""
    if session.is_embedded:
        # In a frame of another site: browsers want Secure, and keep it apart for each site around (CHIPS).
        name = embedded_cookie_name(settings)
        return f"{name}={session.token}; Path=/; HttpOnly; SameSite=None; Secure; Partitioned"
    return _cookie(settings, cookie_name(settings), session.token, f"Max-Age={int(settings.session_hours * 3600)}")


def desk_cookie_name(settings: Settings) -> str:
    """The desk's own: a browser may be a family's and a clinician's at once."""
    return f"{cookie_name(settings)}-desk"


def desk_cookie(settings: Settings, session: ClinicianSession | Visitor) -> str:
    """The Set-Cookie header of the desk: gone when the browser is closed."""
    return _cookie(settings, desk_cookie_name(settings), session.token)


def _cookie(settings: Settings, name: str, value: str, *more: str) -> str:
    parts = [f"{name}={value}", "Path=/", "HttpOnly", "SameSite=Lax", *more]
    return "; ".join([*parts, "Secure"] if settings.is_https else parts)


def csrf_token(session: HasToken) -> str:
    """What a form or script of ours must send along: known to our pages alone, and different in every session.

    Written behind a fresh mask each time, so that the length of a packed page tells nothing about it.
    """
    mask = secrets.token_bytes(hashlib.sha256().digest_size)
    return (mask + _crossed(mask, _form_secret(session))).hex()


def _form_secret(session: HasToken) -> bytes:
    return hashlib.sha256(b"lubdub csrf\0" + session.token.encode()).digest()


def _crossed(mask: bytes, secret: bytes) -> bytes:
    return bytes(one ^ other for one, other in zip(mask, secret, strict=True))


def is_own_site(connection: HTTPConnection, settings: Settings) -> bool:
    """Whether the browser says that a page of ours makes the call. No word about it counts as no."""
    site = connection.headers.get("sec-fetch-site")
    if site is not None:
        return site == "same-origin"
    origin = connection.headers.get("origin")
    if origin is None:
        return False
    given = urlsplit(origin)
    ours = urlsplit(settings.address)
    return given.netloc in {ours.netloc, connection.headers.get("host", "")} and given.scheme in {"http", "https"}


def refuse_cross_site(request: Request, settings: Settings) -> None:
    """Raises Problem `cross-site` when an unsafe call does not come from a page of ours."""
    if request.method not in SAFE_METHODS and not is_own_site(request, settings):
        raise Problem("cross-site", "Open the page of this service and try again from there.")


def refuse_wrong_token(session: HasToken, token: str | None) -> None:
    """Raises Problem `cross-site` when the session's form token is missing or another's."""
    if token is None or not _is_token(session, token):
        raise Problem("cross-site", "The page is too old. Load it again and repeat what you did.")


async def refuse_foreign(request: Request, session: HasToken, settings: Settings) -> None:
    """Raises Problem `cross-site` for another site's call.

    The session's token comes as a form's field, or as a header of a script's call.
    """
    refuse_cross_site(request, settings)
    token = request.headers.get(CSRF_HEADER) or (await request.form()).get(CSRF_FIELD)
    refuse_wrong_token(session, token if isinstance(token, str) else None)


def own_path(path: str, otherwise: str) -> str:
    """The path, if it leads to a page of ours; else the other one."""
    is_ours = path.startswith("/") and not path.startswith("//") and "\\" not in path and path.isprintable()
    return path if is_ours else otherwise


def _is_token(session: HasToken, token: str) -> bool:
    secret = _form_secret(session)
    if re.fullmatch(f"[0-9a-f]{{{4 * len(secret)}}}", token) is None:
        return False
    given = bytes.fromhex(token)
    return secrets.compare_digest(_crossed(given[: len(secret)], given[len(secret) :]), secret)
