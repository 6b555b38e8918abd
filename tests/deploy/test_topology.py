"""Two web, two view and two worker processes behind the proxy: a whole case while one after the other is killed."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest
import websockets

from lubdub.cases import admin
from lubdub.web.schemas_result import ResultOut
from tests.deploy.topology import Town, proxy_program, town
from tests.postgres import programs
from tests.web.api.test_uploads import begin, path_of, piece, stands_at
from tests.web.family import Family
from tests.web.pages.test_view import CURRENT
from tests.web.service import ROOT, Portal, eventually

DEMO = ROOT / "references" / "demo" / "phone-child"
SCAN = (DEMO / "phone-child.glb").read_bytes()
LANDMARKS = json.loads((DEMO / "landmarks.json").read_text())
SOON_S = 600.0
"""Generous: what is tested is that it comes, and a test machine may be busy."""

pytestmark = [
    pytest.mark.timeout(1800),  # on a calm machine all of it takes a minute and a half
    pytest.mark.skipif(
        proxy_program() is None or programs() is None,
        reason="Caddy or PostgreSQL is missing; ./lubdub test installs them",
    ),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Town]:
    with town(tmp_path_factory.mktemp("town")) as running, pytest.MonkeyPatch.context() as patch:
        patch.setenv("SSL_CERT_FILE", str(running.certificate))
        yield running


@pytest.fixture(scope="module")
def portal(place: Town) -> Portal:
    _, token = admin.create_key(place.settings.database, "clinic", ("cases:read", "cases:write"))
    return Portal(place.client(headers={"Authorization": f"Bearer {token}"}))


@pytest.fixture(autouse=True)
def all_alive(place: Town) -> None:
    place.revive()


def wait(portal: Portal, case: str, *statuses: str) -> dict[str, Any]:
    return dict(eventually(lambda: (now := portal.state(case))["status"] in statuses and now, SOON_S))


def test_a_portals_case_reaches_its_areas_while_workers_and_webs_are_killed(place: Town, portal: Portal) -> None:
    case = portal.open_case()
    half = len(SCAN) // 2
    path = path_of(begin(portal, case, len(SCAN)))
    piece(portal, path, 0, SCAN[:half])
    place.webs[0].kill()
    assert stands_at(portal, path) == half
    piece(portal, path, half, SCAN[half:])
    place.revive()
    place.webs[1].kill()
    wait(portal, case, "awaiting_landmarks")
    portal.call("PUT", f"/cases/{case}/landmarks", 202, json=LANDMARKS)
    eventually(lambda: portal.state(case)["status"] in ("running", "done"), SOON_S)
    place.workers[0].kill()
    wait(portal, case, "done")
    result = portal.call("GET", f"/cases/{case}/result", 200).json()
    assert ResultOut.model_validate(result).verdict in ("show", "show_with_care")
    assert len(result["areas"]) == 4
    with portal.http.stream("GET", f"/api/v1/cases/{case}/events") as stream:
        numbers = [int(line[4:]) for line in stream.iter_lines() if line.startswith("id: ")]
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_job_whose_worker_is_killed_is_done_by_the_other_one(place: Town, portal: Portal) -> None:
    """Whichever has it: both are killed once, and never at the same time."""
    cases = [portal.open_case() for _ in range(3)]
    for case in cases:
        portal.send(case, SCAN)
    for worker in place.workers:
        worker.kill()
        place.revive()
    for case in cases:
        assert wait(portal, case, "awaiting_landmarks", "failed", "refused")["status"] == "awaiting_landmarks"


def test_a_scan_whose_web_is_killed_is_not_half_taken_and_can_be_sent_again(place: Town, portal: Portal) -> None:
    case = portal.open_case()
    place.webs[1].kill()
    half_sent, is_killed = threading.Event(), threading.Event()

    def slowly() -> Iterator[bytes]:
        yield SCAN[:50_000]
        half_sent.set()
        is_killed.wait(60)
        yield SCAN[50_000:]

    def send() -> int | str:
        with httpx.Client(base_url=place.settings.address, headers=portal.http.headers, verify=place.tls) as once:
            try:
                return once.put(f"/api/v1/cases/{case}/scan", content=slowly(), timeout=90).status_code
            except httpx.TransportError as error:
                return type(error).__name__

    with ThreadPoolExecutor(1) as threads:
        answer = threads.submit(send)
        assert half_sent.wait(60)
        place.webs[0].kill()
        is_killed.set()
        assert answer.result() != 202
    place.revive()
    assert portal.state(case)["status"] == "awaiting_scan"
    portal.send(case, SCAN)
    wait(portal, case, "awaiting_landmarks")


def test_an_event_stream_goes_on_at_the_other_web_process_without_a_gap(place: Town, portal: Portal) -> None:
    case = portal.open_case()
    seen: list[int] = []

    def listen(until: str) -> None:
        """Up to the event that says so, from where the last connection ended."""
        headers = {"Last-Event-ID": str(seen[-1])} if seen else {}
        with portal.http.stream("GET", f"/api/v1/cases/{case}/events", headers=headers) as stream:
            said = ""
            for line in stream.iter_lines():
                if line.startswith("data: "):
                    said = str(json.loads(line[6:]).get("status"))
                elif line.startswith("id: "):
                    seen.append(int(line[4:]))
                elif not line and said == until:
                    return
        raise AssertionError(f"the stream ended before {until}")

    listen("awaiting_scan")
    place.webs[0].kill()
    portal.send(case, SCAN)
    listen("awaiting_landmarks")
    assert len(seen) > 2
    assert seen == list(range(1, len(seen) + 1))


@pytest.fixture(scope="module")
def family(place: Town) -> Family:
    family = Family(place.service)
    family.http = place.client(follow_redirects=True)
    return family


@pytest.fixture(scope="module")
def marked(family: Family) -> str:
    """A case of a family whose points can be placed."""
    case = family.opened()
    family.send(case, SCAN)
    eventually(lambda: family.where(case) == "size", SOON_S)
    family.post(f"/cases/{case}/size", size="right", side="left")
    family.post(f"/cases/{case}/feel")
    return case


def looking(place: Town, family: Family, case: str) -> Any:
    """A connection to the case's live view, as viser's page makes it."""
    return websockets.connect(
        f"{place.settings.address.replace('https', 'wss')}/view/{case}/ab12",
        ssl=place.tls,
        origin=place.settings.address,  # type: ignore[arg-type]
        additional_headers={"Cookie": "; ".join(f"{k}={v}" for k, v in family.http.cookies.items())},
        subprotocols=[CURRENT],
        max_size=None,
    )


def is_connected(family: Family, case: str) -> bool:
    """Whether the stream beside the picture knows of this window's connection: only the very same process does."""
    with family.http.stream("GET", f"/cases/{case}/points/live?window=ab12") as stream:
        line = next(line for line in stream.iter_lines() if line.startswith("data: "))
    return bool(json.loads(line[6:])["connected"])


async def is_cut_off(socket: Any) -> bool:
    """Whether the other end went away just now."""
    try:
        async with asyncio.timeout(10):
            async for _ in socket:
                pass
    except websockets.ConnectionClosedError:
        return True
    except TimeoutError:
        return False
    return True


def test_a_case_stays_with_one_view_process_and_moves_to_the_other_when_it_is_killed(
    place: Town, family: Family, marked: str
) -> None:
    async def first_bytes() -> Any:
        socket = await looking(place, family, marked)
        await asyncio.wait_for(socket.recv(), 60)
        return socket

    async def scenario() -> int:
        moved = 0
        for view in place.views:
            await asyncio.to_thread(family.get, f"/view/{marked}/ab12/")
            socket = await first_bytes()
            for _ in range(4):  # every call through the proxy meets the process that has the connection
                assert await asyncio.to_thread(is_connected, family, marked)
            await asyncio.to_thread(view.kill)
            if await is_cut_off(socket):
                moved += 1
                # What the page does then: it loads the picture anew, and another process shows it.
                await asyncio.to_thread(family.get, f"/view/{marked}/ab12/")
                again = await first_bytes()
                assert await asyncio.to_thread(is_connected, family, marked)
                await again.close()
            await socket.close()
            await asyncio.to_thread(place.revive)
        return moved

    family.post(f"/cases/{marked}/points", action="choose", name="navel")
    family.post(f"/cases/{marked}/points", action="skip")
    assert asyncio.run(scenario()) >= 1
    assert family.marks(marked)["skipped"] == ["navel"]
    assert "navel" in family.get(f"/cases/{marked}/points")


def test_the_familys_case_ends_with_a_result_behind_the_proxy(family: Family, marked: str) -> None:
    family.post(f"/cases/{marked}/points", action="done")
    eventually(lambda: family.rest_status(marked) in ("done", "refused", "failed"), SOON_S)
    assert family.rest_status(marked) == "done"
    assert family.where(marked) == "result"


def test_the_inner_workings_are_not_shown_outside(place: Town) -> None:
    with httpx.Client(base_url=place.settings.address, verify=place.tls) as stranger:
        answers = {path: stranger.get(path).status_code for path in ("/readyz", "/metrics", "/livez")}
    assert answers == {"/readyz": 404, "/metrics": 404, "/livez": 200}


def test_nothing_plain_reached_the_store(place: Town) -> None:
    files = [path for path in (place.certificate.parent / "store").rglob("*") if path.is_file()]
    assert files
    assert not any(b"glTF" in path.read_bytes()[:64] for path in files)


def test_processes_share_nothing_on_disk(place: Town) -> None:
    assert not list(Path(place.certificate.parent).glob("*/lubdub.sqlite"))
    assert not list(Path(place.certificate.parent).glob("*/files"))
