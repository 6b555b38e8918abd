"""Several web and view processes over one database: what one of them changes, the others show and tell."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import websockets
from starlette.requests import Request
from websockets.typing import Subprotocol

from lubdub.views.servers import ViewsFull
from lubdub.web.problems import Problem
from lubdub.web.view import live_answer
from tests.web.family import Family, case_in
from tests.web.pages.test_handoff import code_for
from tests.web.pages.test_view import CURRENT
from tests.web.service import Service, eventually, free_port

VIEW = "from lubdub.settings import Settings; from lubdub.web.serve import run_web; run_web(Settings(), 'view')"


@pytest.fixture(scope="module")
def view(service: Service) -> Iterator[Service]:
    """A view process beside the web process: the same files and database, another port."""
    changes = {"port": free_port(), "public_url": service.settings.address, "metrics_port": 0}
    settings = service.settings.model_copy(update=changes)
    other = Service(settings, web_program=VIEW, address=f"http://127.0.0.1:{settings.port}")
    try:
        other.start_web()
        yield other
    finally:
        other.stop()


@pytest.fixture
def family(service: Service) -> Family:
    return Family(service)


def at(view: Service, family: Family) -> httpx.Client:
    """The family's browser, at the view process."""
    return httpx.Client(base_url=view.address, cookies=family.http.cookies, timeout=30)


def heard(lines: Iterator[str]) -> dict[str, Any]:
    return dict(json.loads(next(line for line in lines if line.startswith("data: "))[6:]))


def test_a_change_at_one_process_is_told_by_the_other(service: Service, view: Service, family: Family) -> None:
    case = family.confirmed()
    with at(view, family) as there, there.stream("GET", f"/cases/{case}/points/live") as stream:
        lines = stream.iter_lines()
        before = heard(lines)
        family.post(f"/cases/{case}/points", action="skip")
        assert heard(lines)["version"] != before["version"]


def looking(view: Service, family: Family, case: str) -> Any:
    """A connection to the case's live view, as viser's page makes it."""
    return websockets.connect(
        view.address.replace("http", "ws") + f"/view/{case}",
        origin=view.settings.address,  # type: ignore[arg-type]
        additional_headers={"Cookie": "; ".join(f"{k}={v}" for k, v in family.http.cookies.items())},
        subprotocols=[Subprotocol(CURRENT)],
        max_size=None,
    )


async def until_closed(socket: Any) -> None:
    async for _ in socket:
        pass


def test_a_body_deleted_at_one_process_is_gone_from_the_screen_of_the_other(view: Service, family: Family) -> None:
    case = family.confirmed()
    with at(view, family) as there:
        assert there.get(f"/view/{case}/").status_code == 200

        async def watch() -> int | None:
            async with looking(view, family, case) as socket:
                await asyncio.wait_for(socket.recv(), 20)
                await asyncio.to_thread(family.post, f"/cases/{case}/remove", sure="yes")
                await asyncio.wait_for(until_closed(socket), 20)
                return socket.close_code

        assert asyncio.run(watch()) is not None
        assert there.get(f"/view/{case}/").status_code == 404


def test_a_case_handed_over_at_one_process_leaves_the_stream_of_the_other(
    service: Service, view: Service, family: Family
) -> None:
    case = family.confirmed()
    with at(view, family) as there, there.stream("GET", f"/cases/{case}/points/live") as stream:
        lines = stream.iter_lines()
        heard(lines)
        phone = Family(service)
        moved = phone.post("/handoff", code=code_for(family, case))
        assert case_in(str(moved.url)) == case
        assert not any(line.startswith("data: ") for line in lines)


def test_points_placed_at_both_processes_all_stay(view: Service, family: Family) -> None:
    case = family.confirmed()
    token = family.token()
    with at(view, family) as there:
        headers = {"Origin": view.settings.address}
        for place in ("navel", "nipple_left"):
            family.post(f"/cases/{case}/points", action="choose", name=place)
            answer = there.post(f"/cases/{case}/points", data={"csrf_token": token, "action": "skip"}, headers=headers)
            assert answer.status_code == 303
    assert eventually(lambda: {"navel", "nipple_left"} <= set(family.marks(case)["skipped"]))


@pytest.mark.parametrize(
    "path", ["/", "/desk", "/api/v1/cases", "/api/docs", "/cases/{case}/size", "/static/nhsuk.css"]
)
def test_a_view_process_answers_only_what_must_stay_with_it(view: Service, family: Family, path: str) -> None:
    with at(view, family) as there:
        answer = there.get(path.format(case="0" * 32))
    assert answer.status_code == 404


def test_a_view_process_says_whether_it_is_alive_and_ready(view: Service) -> None:
    assert httpx.get(f"{view.address}/livez").json() == {"status": "alive"}
    assert httpx.get(f"{view.address}/readyz").json()["checks"]["database"] is True


def test_a_full_view_process_says_when_to_come_back() -> None:
    def full() -> None:
        raise ViewsFull

    request = Request({"type": "http", "query_string": b"", "headers": [], "path": "/", "method": "GET"})
    with pytest.raises(Problem) as told:
        live_answer(request, full)
    assert told.value.status_code == 503
    assert int(dict(told.value.headers or {})["Retry-After"]) > 0


def test_a_view_process_that_is_killed_comes_back_with_the_picture_and_every_mark(
    view: Service, family: Family
) -> None:
    case = family.confirmed()
    (process,) = view.processes

    async def watch() -> None:
        async with looking(view, family, case) as socket:
            await asyncio.wait_for(socket.recv(), 20)
            await asyncio.to_thread(family.post, f"/cases/{case}/points", action="skip")
            process.kill()
            with pytest.raises(websockets.ConnectionClosedError):
                await asyncio.wait_for(until_closed(socket), 20)
        await asyncio.to_thread(view.start_web)
        await asyncio.to_thread(there.get, f"/view/{case}/")
        async with looking(view, family, case) as again:
            await asyncio.wait_for(again.recv(), 20)

    with at(view, family) as there:
        assert there.get(f"/view/{case}/").status_code == 200
        asyncio.run(watch())
    assert len(family.marks(case)["skipped"]) == 1
