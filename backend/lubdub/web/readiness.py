"""Can this process do its work? Looked at for real, and no more often than every few seconds."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence
from datetime import timedelta
from typing import Any

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.probe import probe_database
from lubdub.cases.work import Seen, WorkDesk
from lubdub.jobs.metrics import READY

WORKER_SEEN = timedelta(seconds=30)
"""A worker tells that it lives every few seconds."""
KEPT_S = 2.0
"""However often somebody asks, the store and the database are written to no more often than this."""

log = logging.getLogger(__name__)


class Readiness:
    """What was found when it was last looked at."""

    def __init__(
        self, database: Database, files: FileVault, desk: WorkDesk, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Over the open services."""
        self._database, self._files, self._desk = database, files, desk
        self._clock = clock
        self._lock = threading.Lock()
        self._found: dict[str, Any] = {}
        self._found_at = 0.0

    def look(self) -> dict[str, Any]:
        """ready, checks by name, the worker's solver, and what limits hold where scans are read (see `kept_by_all`)."""
        with self._lock:
            if not self._found or self._clock() - self._found_at >= KEPT_S:
                self._found = self._looked()
                self._found_at = self._clock()
            return self._found

    def _looked(self) -> dict[str, Any]:
        workers: list[Seen] = []
        checks = {
            "database": _works(lambda: probe_database(self._database)),
            "store": _works(self._files.probe),
            "key": _works(self._files.check_key),
            "worker": _works(lambda: workers.extend(self._living_workers())),
        }
        for name, works in checks.items():
            READY.labels(name).set(works)
        solver = workers[0].solver if workers else None
        return {"ready": all(checks.values()), "checks": checks, "solver": solver, "sandbox": kept_by_all(workers)}

    def _living_workers(self) -> list[Seen]:
        seen = self._desk.seen_within(WORKER_SEEN)
        if not seen:
            raise TimeoutError("no worker was seen lately")
        return seen


def kept_by_all(workers: Sequence[Seen]) -> dict[str, Any]:
    """The limits that all living workers name alike and the protections that all have; False where they differ."""
    if not workers:
        return {}
    first, *others = [worker.sandbox for worker in workers]
    return {name: said if all(one.get(name) == said for one in others) else False for name, said in first.items()}


def _works(check: Callable[[], object]) -> bool:
    try:
        check()
    except Exception as error:  # whatever is broken, the answer is the same: not ready
        log.warning("not ready: %s", type(error).__name__)
        return False
    return True
