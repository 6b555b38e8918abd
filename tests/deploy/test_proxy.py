"""The door of docker-compose.yml, run by itself: what it speaks, and what it does with those who come without https."""

from __future__ import annotations

import os
import socket
import ssl
import subprocess
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from tests.deploy.topology import CADDYFILE, make_certificate, proxy_program
from tests.web.service import eventually, free_port

pytestmark = pytest.mark.skipif(proxy_program() is None, reason="Caddy is missing; ./lubdub test installs it")


@dataclass
class Door:
    """Where the proxy listens, and whom its certificate names."""

    http: int
    https: int
    certificate: Path

    def spoken(self, context: ssl.SSLContext) -> tuple[str, str]:
        """Version and cipher of a connection with it. Raises ssl.SSLError."""
        with (
            socket.create_connection(("127.0.0.1", self.https), timeout=10) as line,
            context.wrap_socket(line, server_hostname="localhost") as secure,
        ):
            cipher = secure.cipher()
            assert cipher is not None
            return str(secure.version()), cipher[0]

    def caller(
        self, lowest: ssl.TLSVersion, highest: ssl.TLSVersion, ciphers: str = "ALL:@SECLEVEL=0"
    ) -> ssl.SSLContext:
        """Somebody who speaks these versions and ciphers alone, however old."""
        context = ssl.create_default_context(cafile=self.certificate)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # that they are old is the point
            context.minimum_version, context.maximum_version = lowest, highest
        context.set_ciphers(ciphers)
        return context


@pytest.fixture(scope="module")
def door(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Door]:
    folder = tmp_path_factory.mktemp("door")
    certificate, key = make_certificate(folder)
    here = Door(free_port(), free_port(), certificate)
    nobody = f"to 127.0.0.1:{free_port()}"
    environment = os.environ | {
        "HOME": str(folder),
        "LUBDUB_BIND": "127.0.0.1",
        "LUBDUB_HOST": "localhost",
        "LUBDUB_HTTP_PORT": str(here.http),
        "LUBDUB_HTTPS_PORT": str(here.https),
        "LUBDUB_TLS_CERTIFICATE": str(certificate),
        "LUBDUB_TLS_KEY": str(key),
        "LUBDUB_WEB_PROCESSES": nobody,
        "LUBDUB_VIEW_PROCESSES": nobody,
    }
    command = [str(proxy_program()), "run", "--adapter", "caddyfile", "--config", str(CADDYFILE)]
    log = (folder / "proxy.log").open("ab")
    process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    try:
        eventually(lambda: is_open(here.https) and is_open(here.http))
        yield here
    finally:
        process.terminate()
        process.wait(20)
        log.close()


def is_open(port: int) -> bool:
    with socket.socket() as line:
        return line.connect_ex(("127.0.0.1", port)) == 0


OLD = (ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1)


def test_it_speaks_the_two_present_versions_of_tls_and_the_latest_first(door: Door) -> None:
    assert door.spoken(door.caller(ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3))[0] == "TLSv1.3"
    assert door.spoken(door.caller(ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_2))[0] == "TLSv1.2"


def test_older_versions_are_refused_by_the_door_and_not_by_the_caller(door: Door) -> None:
    with pytest.raises(ssl.SSLError, match=r"(?i)alert protocol version"):
        door.spoken(door.caller(*OLD))


@pytest.mark.parametrize("weak", ["AES128-GCM-SHA256", "AES256-SHA", "NULL-SHA256", "ECDHE-ECDSA-AES128-SHA256"])
def test_ciphers_without_forward_secrecy_or_authentication_are_refused(door: Door, weak: str) -> None:
    two = ssl.TLSVersion.TLSv1_2
    only_weak = door.caller(two, two, f"{weak}:@SECLEVEL=0")
    with pytest.raises(ssl.SSLError, match=r"(?i)alert handshake failure"):
        door.spoken(only_weak)
    assert door.spoken(door.caller(two, two))[1].startswith("ECDHE-ECDSA-")


def test_a_page_is_sent_on_to_https_and_a_program_is_told_its_mistake(door: Door) -> None:
    plain = httpx.Client(base_url=f"http://localhost:{door.http}", trust_env=False)
    page = plain.get("/desk/sign-in?back=/desk")
    assert (page.status_code, page.headers["location"]) == (308, "https://localhost/desk/sign-in?back=/desk")
    for path in ("/api/v1/cases", "/api/v1/oauth/token"):
        told = plain.get(path, headers={"Authorization": "Bearer lubdub_x"})
        assert (told.status_code, told.headers.get("location")) == (403, None)


def test_no_socket_opens_without_https(door: Door) -> None:
    upgrade = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "x" * 24,
    }
    answer = httpx.get(f"http://localhost:{door.http}/view/{'0' * 32}/ab", headers=upgrade, trust_env=False)
    assert answer.status_code == 308
