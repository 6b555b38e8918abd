"""How much and how often: bodies are capped before and while they are read, calls are counted per caller."""

from __future__ import annotations

import math
from collections.abc import Callable

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import MutableHeaders
from starlette.formparsers import MultiPartParser
from starlette.requests import HTTPConnection, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from lubdub.cases.rates import Budget, Rates, Taken
from lubdub.jobs.metrics import REFUSED, UPLOAD_BYTES
from lubdub.settings import Settings
from lubdub.web.guard import cookie_names, desk_cookie_name
from lubdub.web.problems import Problem, answer_error

MEGABYTE = 1_000_000
FORM_BYTES = 20 * MEGABYTE
"""A page's form, with a small scan in it for browsers without scripts; larger scans are streamed by REST."""
JSON_BYTES = MEGABYTE
UPLOADS = "/api/v1/uploads"
MINUTE_S = 60.0
UNCOUNTED = ("/static/", "/livez", "/readyz")
TRY_AGAIN_LATER = 1013

MultiPartParser.spool_max_size = FORM_BYTES + MEGABYTE
"""A form's file stays in memory: nothing plain is written to a temporary folder."""


def allowed_bytes(scope: Scope, settings: Settings) -> int:
    """The largest body this call may have."""
    path: str = scope["path"]
    if not path.startswith("/api/"):
        return FORM_BYTES
    return settings.max_upload_mb * MEGABYTE if carries_scan(scope) else JSON_BYTES


def carries_scan(scope: Scope) -> bool:
    """Whether the body of this call of the interface is a scan, or a piece of one."""
    path: str = scope["path"]
    is_whole = scope["method"] == "PUT" and path.startswith("/api/") and path.endswith("/scan")
    return is_whole or path.startswith(UPLOADS)


class BodyLimit:
    """Refuses a body that is too large: by its announced length before reading, else as soon as it shows."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        """Around app."""
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One call."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        allowed = allowed_bytes(scope, self._settings)
        headers = HTTPConnection(scope).headers
        if "transfer-encoding" in headers and "content-length" in headers:
            return await _answer(_two_ends(), scope, receive, send)
        announced = headers.get("content-length", "0")
        if not announced.isdecimal() or int(announced) > allowed:
            return await _answer(_too_large(allowed), scope, receive, send)
        taken, is_scan = 0, carries_scan(scope)

        async def counted() -> Message:
            nonlocal taken
            message = await receive()
            arrived = len(message.get("body", b""))
            taken += arrived
            if is_scan:
                UPLOAD_BYTES.inc(arrived)
            if taken > allowed:
                raise _too_large(allowed)
            return message

        return await self._app(scope, counted, send)


async def _answer(problem: Problem, scope: Scope, receive: Receive, send: Send) -> None:
    response = await answer_error(Request(scope), problem)
    await response(scope, receive, send)


def _two_ends() -> Problem:
    """A proxy in front may have gone by the length: what follows on the line may be somebody else's (RFC 9112, 6.1)."""
    return Problem("bad-request", "Say the body's length in one way, not in two.", {"Connection": "close"})


def _too_large(allowed: int) -> Problem:
    return Problem("too-large", f"At most {allowed // MEGABYTE} MB are taken in here.")


def _telling(headers: dict[str, str], send: Send) -> Send:
    async def told(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(headers)
        await send(message)

    return told


class RateLimit:
    """Calls are counted per caller (key, session or address), and per address whatever it shows.

    Programs are told how much is left, as the IETF's draft on rate limit headers has it. Sockets are counted too: a
    page whose session ended dials again and again.
    """

    def __init__(self, app: ASGIApp, settings: Settings, rates: Callable[[], Rates]) -> None:
        """Around app. rates: where calls are counted, asked for at each call."""
        self._app = app
        self._rates = rates
        self._cookies = (*cookie_names(settings), desk_cookie_name(settings))
        self._capacity = settings.requests_per_minute
        self._capacity_of_address = settings.requests_per_minute_of_address

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One call."""
        if scope["type"] == "lifespan" or scope["path"].startswith(UNCOUNTED):
            return await self._app(scope, receive, send)
        taken = await run_in_threadpool(self._rates().take, self._budgets(HTTPConnection(scope)))
        told = self._told(taken)
        if taken.wait_s > 0:
            REFUSED.labels("too many calls").inc()
            if scope["type"] == "websocket":
                return await send({"type": "websocket.close", "code": TRY_AGAIN_LATER})
            told["Retry-After"] = str(math.ceil(taken.wait_s))
            return await _answer(Problem("too-many-requests", "Please wait a little.", told), scope, receive, send)
        if scope["path"].startswith("/api/"):
            return await self._app(scope, receive, _telling(told, send))
        return await self._app(scope, receive, send)

    def _told(self, taken: Taken) -> dict[str, str]:
        """How many calls are left, and in how many seconds all of them are back."""
        until_full = math.ceil((self._capacity - min(self._capacity, taken.left)) * 60 / self._capacity)
        return {
            "RateLimit-Policy": f"{self._capacity};w=60",
            "RateLimit-Limit": str(self._capacity),
            "RateLimit-Remaining": str(int(min(self._capacity, taken.left))),
            "RateLimit-Reset": str(until_full),
        }

    def _budgets(self, connection: HTTPConnection) -> list[Budget]:
        """A token made up for each call gives nobody a bucket more: the address is counted as well."""
        address = connection.client.host if connection.client else "unknown"
        shown = connection.headers.get("authorization") or next(
            (connection.cookies[name] for name in self._cookies if name in connection.cookies), None
        )
        if shown is None:
            return [Budget(f"nobody at {address}", self._capacity, MINUTE_S)]
        of_address = Budget(f"all at {address}", self._capacity_of_address, MINUTE_S)
        return [Budget(f"caller {shown}", self._capacity, MINUTE_S), of_address]
