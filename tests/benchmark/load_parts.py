"""The parts of `load` about jobs and calls: throughput, waits, and ten times too much."""

from __future__ import annotations

import collections
import threading
import time
from typing import Any

from tests.benchmark.experiment import Row
from tests.benchmark.load_service import (
    kept_busy,
    kept_of,
    machine_load,
    paced,
    running,
    scan_bytes,
    whole_cases,
)
from tests.benchmark.load_watch import percentiles_ms, worked_s

CASES = 24
CALLS, PER_SECOND = 400, 10.0
TENFOLD_S = 20.0
CALLERS = 16


def cases_per_minute(workers: int) -> list[Row]:
    """Whole cases that so many workers do in a minute."""
    with running(workers) as place:
        load, before = machine_load(), kept_of(place)
        in_web, in_workers = worked_s([place.web]), worked_s(place.worker_pids)
        seconds = whole_cases(place.portal, CASES)
        in_web, in_workers = worked_s([place.web]) - in_web, worked_s(place.worker_pids) - in_workers
        after = kept_of(place)
    return [
        {
            "part": "cases",
            "workers": workers,
            "cases": CASES,
            "seconds": round(seconds, 1),
            "per_minute": round(60 * CASES / seconds, 1),
            "worker_cpu_s_each": round(in_workers / CASES, 2),
            "web_cpu_s_each": round(in_web / CASES, 2),
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
    with running(2, requests_per_minute=600) as place:
        answers: collections.Counter[str] = collections.Counter()
        accepted: list[str] = []
        lock = threading.Lock()
        end = time.monotonic() + TENFOLD_S

        def call() -> None:
            portal = place.service.portal(name=f"caller {threading.get_ident()}")
            while time.monotonic() < end:
                case = _tried(portal, answers, lock)
                if case is not None:
                    with lock:
                        accepted.append(case[0])
                        keys[case[0]] = case[1]

        keys: dict[str, Any] = {}
        load = machine_load()
        callers = [threading.Thread(target=call) for _ in range(CALLERS)]
        for caller in callers:
            caller.start()
        for caller in callers:
            caller.join()
        ended = _ends(keys)
    told = {name: answers[name] for name in ("accepted", "turned away", "turned away without a word", "failed")}
    return [{"part": "tenfold", "seconds": TENFOLD_S, **told, "lost": len(accepted) - ended, "load": load}]


def _tried(portal: Any, answers: collections.Counter[str], lock: threading.Lock) -> tuple[str, Any] | None:
    """One case opened and its scan sent; None when it was turned away on the way."""
    from tests.web.service import NO_STOPS, PATIENT

    opened = portal.http.post("/api/v1/cases", json={"patient": PATIENT, "answers": NO_STOPS})
    answer = opened
    if opened.status_code == 201:
        answer = portal.http.put(f"/api/v1/cases/{opened.json()['id']}/scan", content=scan_bytes())
    with lock:
        answers[kind_of(answer.status_code, answer.headers.get("retry-after"))] += 1
    if answer.status_code in (429, 503):
        time.sleep(min(2.0, float(answer.headers.get("retry-after", 1))))
    return (opened.json()["id"], portal) if answer.status_code == 202 else None


def kind_of(status: int, retry_after: str | None) -> str:
    """What an answer counts as."""
    if status < 300:
        return "accepted"
    if status in (429, 503):
        return "turned away" if retry_after else "turned away without a word"
    return "failed"


def _ends(portals: dict[str, Any]) -> int:
    """How many of the accepted scans were examined in the end. The portals are patient with their own limits."""
    waiting, ended = dict(portals), 0
    deadline = time.monotonic() + 1800
    while waiting and time.monotonic() < deadline:
        time.sleep(2)
        for case, portal in list(waiting.items()):
            answer = portal.http.get(f"/api/v1/cases/{case}")
            if answer.status_code == 200 and answer.json()["status"] == "awaiting_landmarks":
                del waiting[case]
                ended += 1
    return ended
