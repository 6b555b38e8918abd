"""What every page of the clinicians' desk shares."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlencode

from fastapi import Request
from fastapi.responses import HTMLResponse, Response
from fastapi.sse import ServerSentEvent
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from lubdub.cases.desk_values import ROLES, ClinicianSession, Role, may
from lubdub.web.guard import SAFE_METHODS
from lubdub.web.pages.common import go
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.services import Services

HOME = "/desk"
SIGN_IN = "/desk/sign-in"
BROWSERS = {"Edg/": "Edge", "OPR/": "Opera", "Firefox/": "Firefox", "Chrome/": "Chrome", "Safari/": "Safari"}
SYSTEMS = {
    "iPhone": "iPhone",
    "iPad": "iPad",
    "Android": "Android",
    "CrOS": "ChromeOS",
    "Windows": "Windows",
    "Mac OS X": "Mac",
    "Linux": "Linux",
}
"""Part of how a browser names itself -> the name people know; the first that is found counts."""


def show(
    request: Request, template: str, session: ClinicianSession, status_code: int = 200, **facts: Any
) -> HTMLResponse:
    """A page of the desk for somebody signed in. The template extends `clinician/layout/desk.html`."""
    me = session.clinician
    facts = {"me": me, "may": {least: may(me.role, least) for least in ROLES}, **facts}
    return render(request, template, session, status_code, **facts)


async def is_over(request: Request, session: ClinicianSession) -> bool:
    """Whether a stream to this browser must end: the service stops, or the session does not count any more."""
    if request.app.state.is_stopping():
        return True
    held: Services = request.app.state.services
    return not await run_in_threadpool(held.staff.sessions.is_living, session.id)


OVER = ServerSentEvent(event="over", data={})
"""The last word to a page whose session ended: it loads itself anew and so leads to the sign-in page."""


def role_words(request: Request) -> dict[Role, str]:
    """Each role as pages say it."""
    _ = gettext_of(request)
    return {"clinician": _("Clinician"), "lead": _("Lead"), "administrator": _("Administrator")}


def device_of(request: Request) -> str:
    """Browser and system as people know them, so that they know their own again; else as the browser says."""
    said = request.headers.get("user-agent", "")
    found = (next((name for sign, name in known.items() if sign in said), "") for known in (BROWSERS, SYSTEMS))
    return ", ".join(name for name in found if name) or said


def is_desk(connection: HTTPConnection) -> bool:
    """Whether it is about a page of the desk."""
    path = connection.url.path
    return path == HOME or path.startswith(f"{HOME}/")


def to_sign_in_again(request: Request, pages: tuple[str, ...]) -> Response:
    """To the sign-in page for somebody who is in, and back to where one was; of a form, to the page it stands on."""
    path = request.url.path
    page = next((page for page in pages if path.startswith(f"{page}/")), HOME)
    return go(f"{SIGN_IN}?{urlencode({'again': 1, 'back': path if request.method in SAFE_METHODS else page})}")


def to_sign_in(request: Request) -> Response:
    """To the sign-in page, and back to where one was, if that was a page."""
    if request.method not in SAFE_METHODS or request.url.path == HOME:
        return go(SIGN_IN)
    return go(f"{SIGN_IN}?{urlencode({'back': request.url.path})}")
