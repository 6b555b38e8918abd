"""The parts of `load` about what stays open: event streams, 3D views, and the soak."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from tests.benchmark.experiment import Row
from tests.benchmark.load_service import Running, machine_load, paced, running, scan_bytes, whole_cases
from tests.benchmark.load_watch import percentiles_ms, taken_by

if TYPE_CHECKING:
    from tests.web.family import Family

STREAMS = 200
VIEWS = 50
CALLS, PER_SECOND = 200, 10.0
SETTLE_S = 2.0


def streams() -> list[Row]:
    """Many clients listen to a case each; how soon each hears of a change, and what the streams cost the others."""
    with running(0) as place:
        portal = place.portal
        cases = [portal.open_case() for _ in range(STREAMS)]
        before = taken_by([place.web])
        waits, calls, during = asyncio.run(_listen(place, cases))
        heard = percentiles_ms(waits)
        others = percentiles_ms(calls)
    return [
        {
            "part": "streams",
            "streams": STREAMS,
            "heard_p50_ms": heard["p50_ms"],
            "heard_p99_ms": heard["p99_ms"],
            "other_calls_p99_ms": others["p99_ms"],
            "kB_each": round((during.memory_mb - before.memory_mb) * 1000 / STREAMS, 1),
            "load": machine_load(),
        }
    ]


async def _listen(place: Running, cases: list[str]) -> tuple[list[float], list[float], Any]:
    import httpx

    limits = httpx.Limits(max_connections=None)
    headers = dict(place.portal.http.headers)
    address = place.service.settings.address
    changed: dict[str, float] = {}
    waits: list[float] = []
    listening = asyncio.Semaphore(0)
    async with httpx.AsyncClient(base_url=address, headers=headers, limits=limits, timeout=120) as client:

        async def listen(case: str) -> None:
            async with client.stream("GET", f"/api/v1/cases/{case}/events") as stream:
                async for line in stream.aiter_lines():
                    if not line.startswith("data: "):
                        continue
                    if case in changed:
                        waits.append(time.perf_counter() - changed[case])
                        return
                    listening.release()

        listeners = [asyncio.create_task(listen(case)) for case in cases]
        for _ in cases:
            await listening.acquire()
        during = taken_by([place.web])
        state = [lambda: place.portal.state(cases[0])]
        calls = await asyncio.to_thread(paced, state, CALLS, PER_SECOND)
        for case in cases:
            changed[case] = time.perf_counter()
            await asyncio.to_thread(place.portal.call, "DELETE", f"/cases/{case}", 200)
        await asyncio.gather(*listeners)
    return waits, calls, during


def views() -> list[Row]:
    """Families that look at their bodies, each with a browser attached to a live view of its own."""
    with running(2) as place:
        families = _at_the_points(place, VIEWS)
        before = taken_by([place.web])
        with _looking(place, families):
            during = taken_by([place.web])
            waits = percentiles_ms(paced([lambda: place.service.browser().get("/")], CALLS, PER_SECOND))
    return [
        {
            "part": "views",
            "views": VIEWS,
            "MB_before": before.memory_mb,
            "MB_with_them": during.memory_mb,
            "MB_each": round((during.memory_mb - before.memory_mb) / VIEWS, 2),
            "threads_each": round((during.threads - before.threads) / VIEWS, 1),
            "descriptors_each": round((during.descriptors - before.descriptors) / VIEWS, 1),
            "page_p99_ms": waits["p99_ms"],
            "load": machine_load(),
        }
    ]


def _at_the_points(place: Running, count: int) -> list[tuple[Family, str]]:
    """Families whose scans were examined and whose points can be placed."""
    from tests.web.family import Family
    from tests.web.service import eventually

    sent = []
    for _ in range(count):
        family = Family(place.service)
        case = family.opened()
        family.send(case, scan_bytes())
        sent.append((family, case))
    for family, case in sent:
        eventually(lambda: family.where(case) == "size", 600)  # noqa: B023 (called at once)
        family.post(f"/cases/{case}/size", size="right", side="left")
        family.post(f"/cases/{case}/feel")
    return sent


@contextmanager
def _looking(place: Running, families: list[tuple[Family, str]]) -> Iterator[None]:
    """While this lasts each family's browser is attached, and has the whole picture."""
    import threading

    opened, done = threading.Event(), threading.Event()
    failed: list[BaseException] = []

    def work() -> None:
        try:
            asyncio.run(_attach(place, families, opened, done))
        except BaseException as error:  # told to the caller below
            failed.append(error)
        finally:
            opened.set()

    thread = threading.Thread(target=work)
    thread.start()
    opened.wait()
    try:
        if failed:
            raise RuntimeError("the views could not be opened") from failed[0]
        yield
    finally:
        done.set()
        thread.join()


async def _attach(place: Running, families: list[tuple[Family, str]], opened: Any, done: Any) -> None:
    import viser
    import websockets
    from websockets.typing import Subprotocol

    address = place.service.settings.address
    sockets = []
    for family, case in families:
        await asyncio.to_thread(family.get, f"/view/{case}/")
        cookies = "; ".join(f"{name}={value}" for name, value in family.http.cookies.items())
        socket = await websockets.connect(
            address.replace("http", "ws") + f"/view/{case}",
            origin=address,  # type: ignore[arg-type]
            additional_headers={"Cookie": cookies},
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            max_size=None,
        )
        sockets.append(asyncio.create_task(_drain(socket)))
        sockets[-1].socket = socket  # type: ignore[attr-defined]
    await asyncio.sleep(2)  # the last pictures are on their way
    opened.set()
    await asyncio.to_thread(done.wait)
    for task in sockets:
        await task.socket.close()  # type: ignore[attr-defined]
    await asyncio.gather(*sockets)


async def _drain(socket: Any) -> None:
    import websockets

    try:
        async for _ in socket:
            pass
    except websockets.ConnectionClosed:
        return


def soak(minutes: int) -> list[Row]:
    """Whole cases, a view and a stream opened and ended, everything deleted, over and over. Samples are taken when
    nothing is at work, so that they can be compared."""
    rows: list[Row] = []
    with running(2) as place:
        begun, done = time.monotonic(), 0
        while time.monotonic() - begun < 60 * minutes or len(rows) < 8:
            whole_cases(place.portal, 4)
            _one_family(place)
            done += 5
            for case in place.portal.call("GET", "/cases?limit=50", 200).json()["items"]:
                place.portal.call("DELETE", f"/cases/{case['id']}", 200)
            time.sleep(SETTLE_S)  # connections that ended are noticed to be gone
            taken = taken_by(place.everybody).to_row()
            second = round(time.monotonic() - begun)
            rows.append({"part": "soak", "second": second, "cases": done, **taken})
    return rows


def _one_family(place: Running) -> None:
    families = _at_the_points(place, 1)
    family, case = families[0]
    with _looking(place, families), family.http.stream("GET", f"/cases/{case}/points/live") as stream:
        told = next(line for line in stream.iter_lines() if line.startswith("data: "))
        json.loads(told[6:])
    family.post(f"/cases/{case}/remove")
