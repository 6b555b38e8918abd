"""How much and how often: bodies are capped before and while they are read, calls are counted per caller."""

from __future__ import annotations

import hashlib
import math
import threading
import time
from collections import OrderedDict

from starlette.datastructures import MutableHeaders
from starlette.formparsers import MultiPartParser
from starlette.requests import HTTPConnection, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from lubdub.settings import Settings
from lubdub.web.guard import cookie_name
from lubdub.web.problems import Problem, answer_error

MEGABYTE = 1_000_000
FORM_BYTES = 20 * MEGABYTE
"""A page's form, with a small scan in it for browsers without scripts; larger scans are streamed by REST."""
JSON_BYTES = MEGABYTE
UPLOADS = "/api/v1/uploads"
CALLERS_REMEMBERED = 10_000

MultiPartParser.spool_max_size = FORM_BYTES + MEGABYTE
"""A form's file stays in memory: nothing plain is written to a temporary folder."""


def allowed_bytes(scope: Scope, settings: Settings) -> int:
    """The largest body this call may have."""
    path: str = scope["path"]
    if not path.startswith("/api/"):
        return FORM_BYTES
    is_scan = (scope["method"] == "PUT" and path.endswith("/scan")) or path.startswith(UPLOADS)
    return settings.max_upload_mb * MEGABYTE if is_scan else JSON_BYTES


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
        announced = HTTPConnection(scope).headers.get("content-length", "0")
        if not announced.isdecimal() or int(announced) > allowed:
            return await _answer(_too_large(allowed), scope, receive, send)
        taken = 0

        async def counted() -> Message:
            nonlocal taken
            message = await receive()
            taken += len(message.get("body", b""))
            if taken > allowed:
                raise _too_large(allowed)
            return message

        return await self._app(scope, counted, send)


async def _answer(problem: Problem, scope: Scope, receive: Receive, send: Send) -> None:
    response = await answer_error(Request(scope), problem)
    await response(scope, receive, send)


def _too_large(allowed: int) -> Problem:
    return Problem("too-large", f"At most {allowed // MEGABYTE} MB are taken in here.")


def _telling(headers: dict[str, str], send: Send) -> Send:
    async def told(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(headers)
        await send(message)

    return told


class RateLimit:
    """A bucket of calls per caller (key, session or address), refilled steadily. In memory, per process.

    Programs are told how full it is, as the IETF's draft on rate limit headers has it.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        """Around app."""
        self._app = app
        self._cookie = cookie_name(settings)
        self._capacity = settings.requests_per_minute
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()
        self._lock = threading.Lock()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One call."""
        if scope["type"] == "http" and not scope["path"].startswith(("/static/", "/livez")):
            left, wait = self._take(self._caller(HTTPConnection(scope)), time.monotonic())
            told = self._told(left)
            if wait > 0:
                told["Retry-After"] = str(math.ceil(wait))
                return await _answer(Problem("too-many-requests", "Please wait a little.", told), scope, receive, send)
            if scope["path"].startswith("/api/"):
                return await self._app(scope, receive, _telling(told, send))
        return await self._app(scope, receive, send)

    def _told(self, left: float) -> dict[str, str]:
        """How many calls are left, and in how many seconds all of them are back."""
        until_full = math.ceil((self._capacity - left) * 60 / self._capacity)
        return {
            "RateLimit-Policy": f"{self._capacity};w=60",
            "RateLimit-Limit": str(self._capacity),
            "RateLimit-Remaining": str(int(left)),
            "RateLimit-Reset": str(until_full),
        }

    def _caller(self, connection: HTTPConnection) -> str:
        said = connection.headers.get("authorization") or connection.cookies.get(self._cookie)
        if said is not None:
            return hashlib.sha256(said.encode()).hexdigest()
        return connection.client.host if connection.client else "unknown"

    def _take(self, caller: str, moment: float) -> tuple[float, float]:
        """Take one call out of the caller's bucket; calls left, and seconds to wait when it is empty."""
        per_second = self._capacity / 60
        with self._lock:
            left, since = self._buckets.pop(caller, (float(self._capacity), moment))
            left = min(self._capacity, left + (moment - since) * per_second)
            if left >= 1:
                left -= 1
                wait = 0.0
            else:
                wait = (1 - left) / per_second
            self._buckets[caller] = (left, moment)
            if len(self._buckets) > CALLERS_REMEMBERED:
                self._buckets.popitem(last=False)
        return left, wait
