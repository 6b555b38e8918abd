"""The running service under load, and the clients that load it."""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import subprocess

    from tests.web.service import Portal, Service

PROJECT = Path(__file__).parents[2]
DEMO = PROJECT / "references" / "demo" / "phone-child"
LOOK_S = 0.5
LISTED = 100
MOST_S = 1800.0
ENDED = ("done", "refused", "failed")


@dataclass
class Running:
    """A service, its workers, and a portal of it."""

    service: Service
    portal: Portal
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def web(self) -> int:
        """The web process."""
        return self.service.processes[0].pid

    @property
    def worker_pids(self) -> list[int]:
        """The workers."""
        return [worker.pid for worker in self.workers]

    @property
    def everybody(self) -> list[int]:
        """Web and workers."""
        return [process.pid for process in self.service.processes]


@contextmanager
def running(workers: int, is_warm: bool = True, **settings: Any) -> Iterator[Running]:
    """A web process and workers over a PostgreSQL of their own, or SQLite where there is none. is_warm: the workers
    have done some cases; the first one loads the references."""
    from lubdub.settings import Settings
    from tests.postgres import own_postgres, programs
    from tests.web.service import Service, free_port

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lubdub-load-")))
        url = ""
        if programs() is not None:
            server = stack.enter_context(own_postgres(fsync="on"))
            url = stack.enter_context(server.database())
        told = {"requests_per_minute": 1_000_000} | settings
        service = Service(
            Settings(data_dir=folder / "data", port=free_port(), database_url=url, **told),
            worker_module="lubdub.jobs.worker",
        )
        stack.callback(service.stop)
        service.start_web()
        place = Running(service, service.portal())
        for _ in range(workers):
            place.workers.append(service.start_worker())
        _until(lambda: service.log.read_text().count('"a worker is ready"') >= workers)
        if workers and is_warm:
            whole_cases(place.portal, 2 * workers)
        yield place


def whole_cases(portal: Portal, count: int) -> float:
    """Seconds from the first of so many scans sent at once to the last result. Raises RuntimeError when one fails."""
    scan, landmarks = scan_bytes(), json.loads((DEMO / "landmarks.json").read_text())
    begun = time.perf_counter()
    waiting = {}
    for _ in range(count):
        case = portal.open_case()
        portal.send(case, scan)
        waiting[case] = "checking"
    deadline = time.monotonic() + MOST_S
    while waiting:
        if time.monotonic() > deadline:
            raise RuntimeError(f"{len(waiting)} of {count} cases did not end in {MOST_S:.0f} s")
        time.sleep(LOOK_S)
        # One call for all of them: the clients' work is done on the cores that are measured.
        listed = portal.call("GET", f"/cases?limit={LISTED}", 200).json()["items"]
        for case, status in ((one["id"], one["status"]) for one in listed if one["id"] in waiting):
            if status == "awaiting_landmarks" and waiting[case] == "checking":
                portal.call("PUT", f"/cases/{case}/landmarks", 202, json=landmarks)
                waiting[case] = "locating"
            elif status == "done":
                del waiting[case]
            elif status in ENDED:
                raise RuntimeError(f"a case under load ended as {status}")
    return time.perf_counter() - begun


def kept_of(place: Running) -> tuple[int, int]:
    """Bytes in the store of files, and rows in the database, the queue's own among them."""
    import sqlalchemy as sa

    settings = place.service.settings
    files = [path for path in (settings.data_dir / "files").rglob("*") if path.is_file()]
    rows = 0
    for url in {settings.database, settings.jobs_database}:
        engine = sa.create_engine(sa.make_url(url).set(drivername=_driver(url)))
        with engine.connect() as connection:
            for schema in sa.inspect(engine).get_schema_names():
                if schema in ("information_schema", "pg_catalog"):
                    continue
                for table in sa.inspect(engine).get_table_names(schema):
                    name = sa.table(table, schema=schema)
                    rows += connection.scalar(sa.select(sa.func.count()).select_from(name)) or 0
        engine.dispose()
    return sum(path.stat().st_size for path in files), rows


def _driver(url: str) -> str:
    return "sqlite" if url.startswith("sqlite") else "postgresql+psycopg"


def scan_bytes() -> bytes:
    """A child's scan from a phone."""
    return (DEMO / "phone-child.glb").read_bytes()


@contextmanager
def kept_busy(portal: Portal, at_once: int = 4) -> Iterator[None]:
    """While this lasts there is always a job waiting for the workers."""
    stop = threading.Event()

    def work() -> None:
        while not stop.is_set():
            whole_cases(portal, at_once)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def paced(calls: list[Callable[[], Any]], count: int, per_second: float) -> list[float]:
    """Seconds each call took, so many a second in turns, whatever the answers take: a wait in a queue counts."""
    took = []
    begun = time.perf_counter()
    for number in range(count):
        due = begun + number / per_second
        time.sleep(max(0.0, due - time.perf_counter()))
        calls[number % len(calls)]()
        took.append(time.perf_counter() - max(due, begun))
    return took


def machine_load() -> float:
    """How many processes want a core, on average over the last minute: others may work on this machine too."""
    return round(os.getloadavg()[0], 1)


def _until(happens: Callable[[], bool]) -> None:
    from tests.web.service import eventually

    eventually(happens, 300)
