"""What every answer carries: a request id, the security headers, a new session's cookie; and one log line."""

from __future__ import annotations

import secrets
import time

import structlog
from starlette.datastructures import MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from lubdub.jobs.metrics import REQUEST_SECONDS, REQUESTS, SOCKETS, STREAMS, count_fault
from lubdub.jobs.tracing import trace_call
from lubdub.web.framing import STATE, allow_framing
from lubdub.web.problems import answer_error

PAGE_POLICY = "; ".join(
    (
        "default-src 'self'",
        "img-src 'self' data: blob:",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'self'",
    )
)
"""Scripts and styles come from files of ours alone. A response may set a policy of its own (the 3D view does)."""

HEADERS = {
    "Content-Security-Policy": PAGE_POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Cache-Control": "no-store",
}

STAY_WITH_HTTPS = {"Strict-Transport-Security": "max-age=31536000; includeSubDomains"}
REST = "/api/v1"
METHODS = frozenset({"GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"})
"""A made-up one is counted with all others of its kind: labels must not grow with what strangers think up."""
CLIENT_LEFT = 499
"""Logged, not sent: nobody is there to read it."""

log = structlog.stdlib.get_logger(__name__)


class Envelope:
    """The outermost layer. Responses keep headers they set themselves; static files set their own caching."""

    def __init__(self, app: ASGIApp, is_https: bool) -> None:
        """Around app."""
        self._app = app
        self._headers = HEADERS | (
            {"Strict-Transport-Security": "max-age=31536000; includeSubDomains"} if is_https else {}
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One call."""
        if scope["type"] == "websocket":
            with SOCKETS.track_inprogress():
                return await self._app(scope, receive, send)
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        request_id, started, began_ns = secrets.token_hex(8), time.monotonic(), time.time_ns()
        scope.setdefault("state", {})["request_id"] = request_id
        status, is_stream = 0, False

        async def dressed(message: Message) -> None:
            nonlocal status, is_stream
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers["X-Request-Id"] = request_id
                for name, value in self._headers.items():
                    headers.setdefault(name, value)
                if headers.get("Content-Type", "").startswith("text/event-stream"):
                    headers["Cache-Control"] = HEADERS["Cache-Control"]  # the framework's own would let it be kept
                    is_stream = True
                    STREAMS.inc()
                framed_by = scope["state"].get(STATE)
                if framed_by is not None:
                    allow_framing(headers, framed_by)
                cookie = scope["state"].get("set_cookie")
                if cookie is not None:
                    headers.append("Set-Cookie", cookie)
            await send(message)

        structlog.contextvars.bind_contextvars(request_id=request_id)
        try:
            await self._app(scope, receive, dressed)
        except ClientDisconnect:
            status = CLIENT_LEFT
        except Exception as error:
            count_fault(error)
            if status:
                raise  # half an answer is out; the server closes the connection
            response = await answer_error(Request(scope), error)
            await response(scope, receive, dressed)
        finally:
            if is_stream:
                STREAMS.dec()
            seconds, route = time.monotonic() - started, route_of(scope)
            method = scope["method"] if scope["method"] in METHODS else "other"
            _count(method, route, status, None if is_stream else seconds)
            trace_call(request_id, method, route, status, began_ns)
            log.info("answered", method=scope["method"], route=route, status=status, milliseconds=round(seconds * 1000))
            structlog.contextvars.clear_contextvars()


def _count(method: str, route: str, status: int, seconds: float | None) -> None:
    REQUESTS.labels(method, route, str(status)).inc()
    if seconds is not None:
        REQUEST_SECONDS.labels(route).observe(seconds)


def route_of(scope: Scope) -> str:
    """The path with its holes, such as /cases/{case_id}: what was in them is told to nobody."""
    path = str(getattr(scope.get("route"), "path", "unknown"))
    return f"{REST}{path}" if scope["path"].startswith(f"{REST}/") and not path.startswith(REST) else path
