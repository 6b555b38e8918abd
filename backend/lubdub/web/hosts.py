"""By which names this service may be called: its own. Another name in front of it is somebody else's trick."""

from __future__ import annotations

import ipaddress
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection, Request
from starlette.types import ASGIApp, Receive, Scope, Send

from lubdub.settings import Settings
from lubdub.web.problems import Problem, answer_error

ANY_NAME = ("/livez", "/readyz", "/metrics")
"""For machines that watch, each with its own name for this process; they tell nothing of any person."""
NOT_HERE = 1008


class KnownHosts:
    """Refuses calls that name another host: redirects and the check of origins go by that name.

    It also keeps a page of strangers, whose name was made to lead to this machine, from talking to us as ours.
    A bare address is no name and cannot be made to lead elsewhere. Behind a proxy without LUBDUB_PUBLIC_URL our name is
    not known, so the proxy has to check it.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        """Around app."""
        self._app = app
        public = urlsplit(settings.address).hostname
        self._is_known = bool(settings.public_url) or not settings.behind_tls_proxy
        self._names = {"localhost", public}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One call."""
        if scope["type"] == "lifespan" or not self._is_known or scope["path"] in ANY_NAME:
            return await self._app(scope, receive, send)
        host = _host(HTTPConnection(scope))
        if host in self._names or _is_address(host):
            return await self._app(scope, receive, send)
        if scope["type"] == "websocket":
            return await send({"type": "websocket.close", "code": NOT_HERE})
        problem = Problem("unknown-host", "Open the address that you were given.")
        response = await answer_error(Request(scope), problem)
        return await response(scope, receive, send)


def _host(connection: HTTPConnection) -> str:
    try:
        return urlsplit(f"//{connection.headers.get('host', '')}").hostname or ""
    except ValueError:
        return ""


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
