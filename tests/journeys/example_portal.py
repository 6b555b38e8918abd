"""A small telemedicine portal that has Lubdub built in, made of the documentation alone: a server and two pages.

`GET /` offers a new visit; a visit's page frames the journey; `GET /visits/{id}/result` frames the finished result.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import httpx
from standardwebhooks import Webhook

PATIENT = {"age_years": 6.2, "sex": "male", "posture": "supine"}
NEW_VISIT = '<form method="post" action="/visits"><button>New visit</button></form>'


@dataclass
class ExamplePortal:
    """The portal's server. told: what the webhook said; frame: the documentation's page with a frame in it."""

    lubdub: httpx.Client
    frame: str
    address: str = ""
    secret: str = ""
    told: list[dict[str, Any]] = field(default_factory=list)

    def settle(self) -> None:
        """What is done once: allow our own pages to frame Lubdub, and ask to be told."""
        self._call("PUT", "/embedding", json={"origins": [self.address]})
        hook = self.address.replace("localhost", "127.0.0.1") + "/hook"
        self.secret = self._call("POST", "/webhooks", json={"url": hook})["secret"]

    def open_visit(self) -> str:
        """A new case; its id."""
        return str(self._call("POST", "/cases", json={"patient": PATIENT})["id"])

    def page(self, path: str) -> str:
        """The portal's page of this path."""
        _, *parts = path.split("/")
        if parts[0] != "visits":
            return NEW_VISIT
        shows = "result" if parts[-1] == "result" else "journey"
        link = self._call("POST", f"/cases/{parts[1]}/embed", json={"shows": shows})["url"]
        return self.frame.replace("LINK", link)

    def take_in(self, headers: dict[str, str], body: bytes) -> None:
        """A message of the webhook."""
        self.told.append(Webhook(self.secret).verify(body, headers))

    def _call(self, method: str, path: str, **more: Any) -> dict[str, Any]:
        answer = self.lubdub.request(method, path, **more)
        assert answer.is_success, answer.text
        return dict(answer.json())


@contextmanager
def example_portal(api: str, token: str, frame: str) -> Iterator[ExamplePortal]:
    """The portal, running until the end. Its pages stand at localhost: another site than Lubdub's 127.0.0.1."""
    client = httpx.Client(base_url=f"{api}/api/v1", headers={"Authorization": f"Bearer {token}"}, timeout=60)
    portal = ExamplePortal(client, frame)

    class Answering(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = f'<!doctype html><html lang="en"><title>Portal</title>{portal.page(self.path)}</html>'.encode()
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"] or 0))
            if self.path == "/hook":
                portal.take_in(dict(self.headers), body)
                self.send_response(204)
            else:
                self.send_response(303)
                self.send_header("Location", f"/visits/{portal.open_visit()}")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Nothing on the terminal."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Answering)
    portal.address = f"http://localhost:{server.server_port}"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        portal.settle()
        yield portal
    finally:
        server.shutdown()
        server.server_close()
