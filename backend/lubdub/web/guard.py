"""Who is calling: a portal by its bearer key, or a family by its browser session; and no other page on its behalf."""

from __future__ import annotations

import hashlib
import secrets
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection, Request

from lubdub.cases.values import FamilySession
from lubdub.settings import Settings
from lubdub.web.problems import Problem

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
CSRF_HEADER = "X-CSRF-Token"
CSRF_FIELD = "csrf_token"


def cookie_name(settings: Settings) -> str:
    """`__Host-` binds the cookie to this very host; browsers demand https for it."""
    return "__Host-lubdub" if settings.is_https else "lubdub"


def session_cookie(settings: Settings, session: FamilySession) -> str:
    """The Set-Cookie header of a session."""
    parts = [
        f"{cookie_name(settings)}={session.token}",
        "Path=/",
        "HttpOnly",
        "SameSite=Lax",
        f"Max-Age={int(settings.session_hours * 3600)}",
    ]
    return "; ".join([*parts, "Secure"] if settings.is_https else parts)


def csrf_token(session: FamilySession) -> str:
    """What a form or script of ours must send along: known to our pages alone, and different in every session."""
    return hashlib.sha256(b"lubdub csrf\0" + session.token.encode()).hexdigest()


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


def refuse_wrong_token(session: FamilySession, token: str | None) -> None:
    """Raises Problem `cross-site` when the session's form token is missing or another's."""
    if token is None or not secrets.compare_digest(token.encode(), csrf_token(session).encode()):
        raise Problem("cross-site", "The page is too old. Load it again and repeat what you did.")
