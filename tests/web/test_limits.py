"""Too many calls and too many bytes: counted for everybody alike, by all web processes together."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import httpx
import pytest
import websockets
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.responses import PlainTextResponse
from starlette.routing import Mount
from starlette.types import Receive, Scope, Send

from lubdub.cases.rates import LocalRates
from lubdub.settings import Settings
from lubdub.web.limits import RateLimit
from tests.databases import kinds
from tests.web.api.test_rest import problem
from tests.web.api.test_uploads import begin, path_of
from tests.web.replicas import replicas
from tests.web.service import Service

LIMITS = {
    "max_upload_mb": 2,
    "requests_per_minute": 8,
    "requests_per_minute_of_address": 200,
    "tenant_mb_per_day": 5,
    "family_mb_per_day": 3,
}
MEGABYTE = 1_000_000


async def answer(scope: Scope, receive: Receive, send: Send) -> None:
    await PlainTextResponse("here")(scope, receive, send)


def asked(
    settings: Settings, ask: Callable[[httpx.AsyncClient], Awaitable[list[httpx.Response]]]
) -> list[httpx.Response]:
    """What an application answers that has nothing but the limit."""

    async def run() -> list[httpx.Response]:
        rates = LocalRates()
        layer = Middleware(RateLimit, settings=settings, rates=lambda: rates)
        transport = httpx.ASGITransport(Starlette(routes=[Mount("/", answer)], middleware=[layer]))
        async with httpx.AsyncClient(transport=transport, base_url="http://lubdub") as http:
            return await ask(http)

    return asyncio.run(run())


def test_a_refused_program_is_told_when_to_come_back() -> None:
    async def twice(http: httpx.AsyncClient) -> list[httpx.Response]:
        return [await http.get("/api/x") for _ in range(2)]

    served, refused = asked(Settings(requests_per_minute=1), twice)
    assert served.headers["ratelimit-remaining"] == "0"
    problem(refused, "too-many-requests")
    assert 0 < int(refused.headers["retry-after"]) <= 60
    assert refused.headers["ratelimit-remaining"] == "0"


def test_a_new_token_for_each_call_gives_nobody_more_calls() -> None:
    async def guess(http: httpx.AsyncClient) -> list[httpx.Response]:
        return [await http.get("/api/x", headers={"Authorization": f"Bearer {number}"}) for number in range(8)]

    answers = asked(Settings(requests_per_minute=3, requests_per_minute_of_address=5), guess)
    assert [one.status_code for one in answers] == [200] * 5 + [429] * 3


def test_colleagues_behind_one_address_are_counted_each_for_themselves() -> None:
    async def work(http: httpx.AsyncClient) -> list[httpx.Response]:
        return [await http.get("/", headers={"Cookie": f"lubdub-desk={who}"}) for who in "abab"]

    answers = asked(Settings(requests_per_minute=1), work)
    assert [one.status_code for one in answers] == [200, 200, 429, 429]


def test_styles_and_signs_of_life_are_not_counted() -> None:
    async def look(http: httpx.AsyncClient) -> list[httpx.Response]:
        return [await http.get(path) for path in ("/static/a.css", "/livez", "/readyz", "/", "/")]

    answers = asked(Settings(requests_per_minute=1), look)
    assert [one.status_code for one in answers] == [200, 200, 200, 200, 429]


@pytest.fixture(scope="module", params=kinds())
def pair(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Service]]:
    folder: Path = tmp_path_factory.mktemp("replicas")
    with replicas(request.param, folder, **LIMITS) as services:
        yield services


def test_two_web_processes_count_calls_together(pair: list[Service]) -> None:
    token = pair[0].portal("counted").http.headers["authorization"]
    began = time.monotonic()
    with httpx.Client(headers={"Authorization": token}, timeout=30) as http:
        answers = [http.get(f"{pair[number % 2].settings.address}/api/v1/cases") for number in range(24)]
    came_back = (time.monotonic() - began) * 8 / 60
    served = [one for one in answers if one.status_code == 200]
    assert 8 <= len(served) <= 9 + came_back
    refused = next(one for one in answers if one.status_code == 429)
    problem(refused, "too-many-requests")
    assert int(refused.headers["retry-after"]) >= 1


def test_an_organisation_sends_no_more_bytes_than_its_day_allows(pair: list[Service]) -> None:
    portals = [service.portal("sender") for service in pair]
    for portal in portals:
        begin(portal, portal.open_case(), 2 * MEGABYTE)
    refused = begin(portals[0], portals[0].open_case(), 2 * MEGABYTE, 429)
    problem(refused, "upload-quota")
    assert int(refused.headers["retry-after"]) > 60
    problem(portals[1].send(portals[1].open_case(), b"x" * 1_500_000, 429), "upload-quota")
    assert path_of(begin(portals[1], portals[1].open_case(), MEGABYTE // 2))
    stranger = pair[0].portal("another sender")
    begin(stranger, stranger.open_case(), 2 * MEGABYTE)


def test_a_socket_that_dials_again_and_again_is_slowed_down(pair: list[Service]) -> None:
    address = pair[0].settings.address

    async def statuses() -> list[int]:
        seen = []
        for _ in range(12):
            try:
                async with websockets.connect(
                    address.replace("http", "ws") + "/view/none",
                    origin=address,  # type: ignore[arg-type]
                    additional_headers={"Cookie": "lubdub=ended"},
                ):
                    pass
            except websockets.InvalidStatus as refused:
                seen.append(refused.response.status_code)
        return seen

    assert asyncio.run(statuses()) == [403] * 12
    pages = [httpx.get(f"{address}/", cookies={"lubdub": "ended"}).status_code for _ in range(4)]
    assert 429 in pages
