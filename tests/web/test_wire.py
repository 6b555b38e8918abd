"""What is sent as raw bytes: messages whose ends could be read in two ways, oversized heads, forged lines."""

from __future__ import annotations

import asyncio
import json
import re
import secrets
import socket
from urllib.parse import urlsplit

import httpx
import pytest
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.responses import PlainTextResponse
from starlette.routing import Mount
from starlette.types import Receive, Scope, Send

from lubdub.settings import Settings
from lubdub.web.hosts import KnownHosts
from tests.web.api.test_rest import problem
from tests.web.family import Family
from tests.web.service import Portal, Service, eventually

SMUGGLED = b"GET /api/v1/smuggled HTTP/1.1\r\nHost: x\r\n\r\n"


def spoken(service: Service, message: bytes) -> bytes:
    """All the server says to these bytes until it hangs up."""
    with socket.create_connection(("127.0.0.1", service.settings.port), timeout=20) as line:
        line.sendall(message)
        said = b""
        while block := line.recv(65_536):
            said += block
    return said


def post(*headers: str, body: bytes = b"", path: str = "/api/v1/oauth/token") -> bytes:
    return "\r\n".join([f"POST {path} HTTP/1.1", "Host: 127.0.0.1", *headers, "", ""]).encode("latin-1") + body


def statuses(said: bytes) -> list[int]:
    return [int(part[:3]) for part in said.split(b"HTTP/1.1 ")[1:]]


CHUNKED = b"0\r\n\r\n"


@pytest.mark.parametrize(
    "message",
    [
        pytest.param(post("Content-Length: 4", "Content-Length: 44", body=b"abcd" + SMUGGLED), id="two-lengths"),
        pytest.param(post("Content-Length: 4, 44", body=b"abcd" + SMUGGLED), id="two-lengths-in-one-line"),
        pytest.param(post("Content-Length: +4", body=b"abcd" + SMUGGLED), id="signed-length"),
        pytest.param(post("Content-Length: 0x4", body=b"abcd" + SMUGGLED), id="hexadecimal-length"),
        pytest.param(post("Content-Length: -1", body=SMUGGLED), id="negative-length"),
        pytest.param(post("Transfer-Encoding: xchunked", body=CHUNKED + SMUGGLED), id="unknown-coding"),
        pytest.param(post("Transfer-Encoding: chunked, identity", body=CHUNKED + SMUGGLED), id="two-codings"),
        pytest.param(
            post("Transfer-Encoding: chunked", "Transfer-Encoding: chunked", body=CHUNKED + SMUGGLED), id="coded-twice"
        ),
        pytest.param(post("Transfer-Encoding : chunked", body=CHUNKED + SMUGGLED), id="space-before-the-colon"),
        pytest.param(post("Transfer-Encoding:\x0bchunked", body=CHUNKED + SMUGGLED), id="vertical-tab"),
        pytest.param(post("Transfer-Encoding: chunked", body=b"zz\r\n" + SMUGGLED), id="chunk-of-no-length"),
        pytest.param(post("Transfer-Encoding: chunked", body=b"-4\r\nabcd\r\n" + SMUGGLED), id="negative-chunk"),
        pytest.param(post("X-Long: a\r\x00b", body=SMUGGLED), id="null-in-a-header"),
        pytest.param(b"GET /livez HTTP/1.1\r\nContent-Length: 4\r\n\r\nabcd" + SMUGGLED, id="no-host"),
        pytest.param(b"GET /livez HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", id="two-hosts"),
        pytest.param(b"GET /livez HTTP/1.1 \r\nHost: a\r\n\r\n", id="space-after-the-version"),
        pytest.param(b"GET /livez\x00 HTTP/1.1\r\nHost: a\r\n\r\n", id="null-in-the-path"),
        pytest.param(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", id="another-version"),
    ],
)
def test_a_message_whose_end_is_unclear_is_refused_and_the_line_is_cut(service: Service, message: bytes) -> None:
    *before, last = statuses(spoken(service, message))
    assert last == 400
    assert set(before) <= {421}


@pytest.mark.parametrize("order", [1, -1], ids=["coding-first", "length-first"])
def test_a_body_with_a_length_and_a_coding_is_refused_and_nothing_behind_it_is_a_call(
    service: Service, order: int
) -> None:
    both = ["Transfer-Encoding: chunked", "Content-Length: 4"][::order]
    said = spoken(service, post(*both, body=CHUNKED + SMUGGLED))
    assert statuses(said) == [400]
    assert b"connection: close" in said.lower()


def test_a_folded_header_is_one_header(service: Service) -> None:
    said = spoken(
        service,
        b"GET /livez HTTP/1.1\r\nHost: a\r\nX-Long: b\r\n Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n",
    )
    assert statuses(said) == [200]


@pytest.mark.parametrize("size", [70_000, 2_000_000])
def test_a_huge_head_is_refused(service: Service, size: int) -> None:
    head = b"GET /livez HTTP/1.1\r\nHost: a\r\nX-Long: " + b"a" * size
    with socket.create_connection(("127.0.0.1", service.settings.port), timeout=20) as line:
        said = b""
        try:
            line.sendall(head)
            while block := line.recv(65_536):
                said += block
        except ConnectionError:
            pass  # cut while it was still being sent
    assert statuses(said) in ([], [400], [431])
    assert httpx.get(f"{service.settings.address}/livez").status_code == 200


def test_headers_without_end_do_not_fill_the_memory(service: Service) -> None:
    with socket.create_connection(("127.0.0.1", service.settings.port), timeout=20) as line:
        line.sendall(b"GET /livez HTTP/1.1\r\nHost: a\r\n")
        many = b"".join(f"X-{number}: {'a' * 90}\r\n".encode() for number in range(100_000))
        with pytest.raises(ConnectionError):
            line.sendall(many)


@pytest.mark.parametrize("method", ["TRACE", "CONNECT", "DEBUG", "PROPFIND"])
def test_methods_that_nobody_needs_are_not_answered(service: Service, method: str) -> None:
    said = spoken(
        service, f"{method} /livez HTTP/1.1\r\nHost: a\r\nConnection: close\r\nX-Echo: secret\r\n\r\n".encode()
    )
    assert statuses(said)[0] in (400, 405)
    assert b"secret" not in said


@pytest.mark.parametrize("path", ["/cases/%0d%0aSet-Cookie:%20a=b", "/desk/sign-in?back=%0d%0aSet-Cookie:%20a=b"])
def test_a_line_break_in_a_path_makes_no_header(service: Service, path: str) -> None:
    with httpx.Client(base_url=service.settings.address, timeout=30, follow_redirects=False) as http:
        answer = http.get(path)
    assert answer.cookies.get("a") is None
    assert not any(name.lower() == "a" or "a=b" in value for name, value in answer.headers.items())


def test_a_line_break_sent_by_a_caller_makes_no_line_in_the_log(service: Service, portal: Portal) -> None:
    mark = f"forged{secrets.token_hex(8)}"
    forged = f'x\n{{"event": "{mark}"}}'
    portal.call("POST", "/cases", 422, json={"patient": {"age_years": forged}, "answers": {forged: True}})
    service.browser().get("/nothing/" + forged.replace("\n", "%0A"))
    service.browser().get("/", headers={"User-Agent": mark})
    portal.call("GET", "/livez/../cases", 200)
    marks = [line for line in service.log.read_text().splitlines() if mark in line]
    assert marks == []
    assert all(json.loads(line) for line in service.log.read_text().splitlines())


def test_secrets_in_headers_cookies_and_addresses_are_never_logged(service: Service) -> None:
    word = secrets.token_hex(12)
    http = service.browser()
    http.get(f"/embed/{word}")
    http.get(f"/desk/join?link={word}")
    http.get("/api/v1/cases", headers={"Authorization": f"Bearer {word}"})
    http.get("/", headers={"Cookie": f"lubdub={word}", "Referer": f"https://x.example/{word}"})
    http.post("/api/v1/oauth/token", data={"grant_type": "client_credentials", "client_id": "a", "client_secret": word})
    Family(service).post("/invited", 422, link=word)
    eventually(lambda: '"/api/v1/oauth/token"' in service.log.read_text())
    assert word not in service.log.read_text()


def test_who_calls_is_believed_of_the_proxy_alone(service: Service) -> None:
    """Without a proxy in front, a caller who names another address is not counted under it."""
    port = service.settings.port
    seen = {
        httpx.get(f"http://127.0.0.1:{port}/nothing", headers={"X-Forwarded-For": f"10.0.0.{number}"}).status_code
        for number in range(3)
    }
    assert seen == {404}
    with pytest.raises(ValueError, match="LUBDUB_TRUSTED_PROXIES"):
        Settings(trusted_proxies="everybody")
    with pytest.raises(ValueError, match="LUBDUB_TRUSTED_PROXIES"):
        Settings(trusted_proxies="*")


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "a@b", "[::1", ""])
def test_a_call_under_a_strangers_name_is_refused(service: Service, host: str) -> None:
    """Also what keeps a strange page out whose name was made to lead to this machine."""
    for path in ("/", "/api/docs/", "/desk/sign-in"):
        said = httpx.get(f"{service.settings.address}{path}", headers={"Host": host}, follow_redirects=False)
        assert said.status_code in (400, 421)
        assert "evil.example" not in said.text + str(said.headers)
    problem(httpx.get(f"{service.settings.address}/api/v1/cases", headers={"Host": "evil.example"}), "unknown-host")


@pytest.mark.parametrize("host", ["localhost", "localhost:1", "127.0.0.1", "10.1.2.3:8000", "[::1]:8000"])
def test_our_own_name_and_bare_addresses_are_known(service: Service, host: str) -> None:
    assert httpx.get(f"{service.settings.address}/", headers={"Host": host}).status_code == 200


def test_behind_a_proxy_the_public_name_is_the_one_that_counts() -> None:
    async def asked(settings: Settings, *hosts: str) -> list[int]:
        transport = httpx.ASGITransport(
            Starlette(routes=[Mount("/", here)], middleware=[Middleware(KnownHosts, settings=settings)])
        )
        async with httpx.AsyncClient(transport=transport, base_url="http://10.0.0.1") as http:
            return [(await http.get("/", headers={"Host": host})).status_code for host in hosts]

    named = Settings(behind_tls_proxy=True, public_url="https://lubdub.example")
    assert asyncio.run(asked(named, "lubdub.example", "LUBDUB.example:443", "other.example")) == [200, 200, 421]
    assert asyncio.run(asked(Settings(behind_tls_proxy=True), "any.example")) == [200]


async def here(scope: Scope, receive: Receive, send: Send) -> None:
    await PlainTextResponse("here")(scope, receive, send)


@pytest.mark.parametrize("path", ["//evil.example/", "//evil.example", "/%5Cevil.example/", "/api/docs/", "/desk/"])
def test_a_redirect_never_leads_to_another_host(service: Service, path: str) -> None:
    said = spoken(service, f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n".encode())
    places = re.findall(rb"(?i)\nlocation: (\S+)", said)
    assert all(urlsplit(place).netloc in (b"", b"127.0.0.1") for place in places)
