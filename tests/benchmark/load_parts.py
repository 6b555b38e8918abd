"""The parts of `load` about jobs and calls: throughput, waits, and ten times too much."""

from __future__ import annotations

import collections
import threading
import time
from collections.abc import Sequence, Set
from typing import TYPE_CHECKING, Any

from tests.benchmark.experiment import Row
from tests.benchmark.load_service import (
    MOST_S,
    kept_busy,
    kept_of,
    machine_load,
    paced,
    running,
    scan_bytes,
    whole_cases,
)
from tests.benchmark.load_watch import machine_worked_s, percentiles_ms, worked_s

if TYPE_CHECKING:
    from tests.web.service import Portal

CASES = 24
CALLS, PER_SECOND = 400, 10.0
TENFOLD_S = 20.0
CALLERS = 6
CALLS_A_MINUTE = 30
"""What each caller may ask in the tenfold part: the first half minute's worth at once, and then one call in 2 s."""


def cases_per_minute(workers: int, round_number: int) -> list[Row]:
    """Whole cases that so many workers do in a minute, and how many cores all of it keeps busy."""
    with running(workers) as place:
        load, before = machine_load(), kept_of(place)
        in_web, in_workers = worked_s([place.web]), worked_s(place.worker_pids)
        machine = machine_worked_s()
        seconds = whole_cases(place.portal, CASES)
        machine = machine_worked_s() - machine
        in_web, in_workers = worked_s([place.web]) - in_web, worked_s(place.worker_pids) - in_workers
        after = kept_of(place)
    return [
        {
            "part": "cases",
            "workers": workers,
            "round": round_number,
            "cases": CASES,
            "seconds": round(seconds, 1),
            "per_minute": round(60 * CASES / seconds, 1),
            "worker_cpu_s_each": round(in_workers / CASES, 2),
            "web_cpu_s_each": round(in_web / CASES, 2),
            "machine_cpu_s_each": round(machine / CASES, 2),
            "cores_busy": round(machine / seconds, 2),
            "stored_kB_each": round((after[0] - before[0]) / 1000 / CASES),
            "rows_each": round((after[1] - before[1]) / CASES, 1),
            "load": load,
        }
    ]


def latencies() -> list[Row]:
    """Waits of a page and of REST, with idle workers and with two that always have a job."""
    with running(2) as place:
        case = place.portal.open_case()
        browser = place.service.browser()
        browser.get("/")
        page = [lambda: browser.get("/"), lambda: browser.get("/ask/who")]
        rest = [lambda: place.portal.state(case), place.portal.open_case]
        rows = [_waits("idle", what, calls) for what, calls in (("page", page), ("REST", rest))]
        with kept_busy(place.portal):
            rows += [_waits("busy", what, calls) for what, calls in (("page", page), ("REST", rest))]
    return rows


def _waits(workers: str, what: str, calls: list[Any]) -> Row:
    load = machine_load()
    return {
        "part": "latency",
        "workers": workers,
        "what": what,
        **percentiles_ms(paced(calls, CALLS, PER_SECOND)),
        "load": load,
    }


def tenfold() -> list[Row]:
    """Callers that send scans as fast as they can, far above the workers' pace and the allowed number of calls: who is
    turned away is told when to come back, and what was accepted is done all the same."""
    with running(2, is_warm=False, requests_per_minute=CALLS_A_MINUTE) as place:
        answers: collections.Counter[str] = collections.Counter()
        portals = [place.service.portal(name=f"caller {number}") for number in range(CALLERS)]
        accepted: set[str] = set()
        lock = threading.Lock()
        load = machine_load()
        begun = time.monotonic()

        def call(portal: Portal) -> None:
            while time.monotonic() - begun < TENFOLD_S:
                answer, case = _tried(portal)
                with lock:
                    answers[answer] += 1
                    if case is not None:
                        accepted.add(case)

        callers = [threading.Thread(target=call, args=(portal,)) for portal in portals]
        for caller in callers:
            caller.start()
        for caller in callers:
            caller.join()
        ended = _ends(accepted, portals)
        seconds = time.monotonic() - begun
    told = {name: answers[name] for name in ("accepted", "turned away", "turned away without a word", "failed")}
    lost = len(accepted) - ended
    return [{"part": "tenfold", "seconds": TENFOLD_S, **told, "all_done_s": round(seconds), "lost": lost, "load": load}]


def _tried(portal: Portal) -> tuple[str, str | None]:
    """A case opened and its scan sent: how the last call was answered, and the case if its scan was accepted."""
    from tests.web.service import NO_STOPS, PATIENT

    answer = opened = portal.http.post("/api/v1/cases", json={"patient": PATIENT, "answers": NO_STOPS})
    if opened.status_code == 201:
        answer = portal.http.put(f"/api/v1/cases/{opened.json()['id']}/scan", content=scan_bytes())
    kind = kind_of(answer.status_code, answer.headers.get("retry-after"))
    if kind.startswith("turned away"):
        time.sleep(min(2.0, float(answer.headers.get("retry-after", 1))))
    return kind, opened.json()["id"] if answer.status_code == 202 else None


def kind_of(status: int, retry_after: str | None) -> str:
    """What an answer counts as."""
    if status < 300:
        return "accepted"
    if status in (429, 503):
        return "turned away" if retry_after else "turned away without a word"
    return "failed"


def _ends(accepted: Set[str], portals: Sequence[Portal]) -> int:
    """How many of the accepted scans were examined in the end. Who asks is patient with the limits of the portals."""
    ended: set[str] = set()
    deadline = time.monotonic() + MOST_S
    while len(ended) < len(accepted) and time.monotonic() < deadline:
        time.sleep(2 * 60 / CALLS_A_MINUTE)
        for portal in portals:
            answer = portal.http.get("/api/v1/cases", params={"status": "awaiting_landmarks", "limit": 100})
            if answer.status_code == 200:
                ended |= {case["id"] for case in answer.json()["items"]} & accepted
    return len(ended)
