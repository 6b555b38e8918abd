"""What the web process does, without one: cases come in here, and real workers do them."""

from __future__ import annotations

import itertools
import os
import select
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from unittest.mock import patch

import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.models import CaseEventRow, CaseRow, FileRow
from lubdub.cases.people import People
from lubdub.cases.privacy import Privacy
from lubdub.cases.sharing import Sharing
from lubdub.cases.store import CaseStore
from lubdub.cases.values import SYSTEM, Actor, Case, Job
from lubdub.cases.work import WorkDesk
from lubdub.jobs.engine import DbosEngine, jobs_url
from lubdub.jobs.forkserver import ForkServer
from lubdub.jobs.liveness import open_locks
from lubdub.jobs.sandbox import Limits
from lubdub.jobs.upkeep import Desks, Known, Upkeep
from lubdub.jobs.work import JobSettings, TaskNames, Workbench
from lubdub.settings import Settings
from tests.cases.conftest import girl_of_six
from tests.web.service import Service, eventually, free_port

PATIENCE_S = 120.0
"""A busy machine starts a worker slowly."""
ONCE = ["awaiting_scan", "checking", "awaiting_landmarks"]
"""The states of a case whose check went well, and was done once."""
Worker = subprocess.Popen[bytes]


@dataclass(frozen=True)
class Desk:
    """Services on the cases' database, and the gate at which stand-in jobs wait."""

    service: Service
    database: Database
    store: CaseStore
    vault: FileVault
    engine: DbosEngine
    actor: Actor
    gate: Path
    """A job runs until this file is there."""

    def receive(self, order: str | None = None, actor: Actor | None = None) -> tuple[str, Job]:
        """A case whose scan is taken and whose job nobody has told the queue of. order: to the stand-in job."""
        actor = actor or self.actor
        case, _ = self.store.create(actor, girl_of_six())
        scan = self.vault.seal(case.id, "scan", (order or f"until {self.gate}").encode())
        return case.id, self.store.receive_scan(actor, case.id, scan, None)[1]

    def send(self, order: str | None = None, actor: Actor | None = None) -> str:
        """The same, and the queue knows."""
        case, job = self.receive(order, actor)
        self.engine.submit(job)
        return case

    def portal(self, name: str) -> Actor:
        """Another organisation."""
        key, _ = People(self.database).create_key(name, ["cases:read", "cases:write"])
        return Actor("key", key.id, key.tenant_id)

    def state(self, case: str) -> Case:
        """How the case stands, whoever owns it."""
        return self.store.get(SYSTEM, case)

    def story(self, case: str) -> list[tuple[str, datetime]]:
        """All that happened to it and when, in order: its states, and the stages of its jobs."""
        told = sa.select(CaseEventRow).where(CaseEventRow.case_id == case).order_by(CaseEventRow.sequence)
        with self.database.reading() as session:
            return [(_word(event), event.at) for event in session.scalars(told)]

    def statuses(self, case: str) -> list[str]:
        """Every state it went through, in order."""
        return [word for word, _ in self.story(case) if not word.startswith("stage ")]

    def longest_silence(self, case: str) -> timedelta:
        """Between two things that happened to it, by the clock of who wrote them down."""
        moments = [at for _, at in self.story(case)]
        return max(later - earlier for earlier, later in itertools.pairwise(moments))

    def files(self, case: str) -> list[str]:
        """What it holds."""
        with self.database.reading() as session:
            return sorted(session.scalars(sa.select(FileRow.artefact).where(FileRow.case_id == case)))

    def objects(self, case: str) -> list[Path]:
        """What lies in the store for it, whole and with or without a name in the database."""
        folder = self.service.settings.data_dir / "files" / case
        return [path for path in folder.glob("*") if "#" not in path.name]  # a file still being written has one

    def delete(self, case: str) -> None:
        """As the family wishes."""
        Privacy(self.database, self.vault).delete(self.actor, case)

    @contextmanager
    def held(self, case: str) -> Iterator[None]:
        """Meanwhile nobody else can commit a change of it."""
        with self.database.writing() as session:
            session.scalar(sa.select(CaseRow).where(CaseRow.id == case).with_for_update())
            yield

    @contextmanager
    def queue(self) -> Iterator[tuple[sa.Connection, sa.TableClause]]:
        """The queue's own table of jobs, in a transaction; nobody else can change the rows that it changes."""
        engine = sa.create_engine(jobs_url(self.service.settings.jobs_database))
        schema = None if self.database.is_sqlite else "dbos"
        table = sa.table("workflow_status", sa.column("workflow_uuid"), sa.column("completed_at"), schema=schema)
        with engine.begin() as connection:
            yield connection, table
        engine.dispose()

    @contextmanager
    def unheard(self, job_id: str) -> Iterator[None]:
        """Meanwhile the queue takes no word of this job, and afterwards what was said is lost with who said it."""
        with self.queue() as (queue, jobs):
            queue.execute(jobs.update().where(jobs.c.workflow_uuid == job_id).values(completed_at=None))
            yield
            if not self.database.is_sqlite:  # whose server holds the call of a dead process until it can be done
                waiting = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database()"
                queue.execute(sa.text(f"{waiting} AND wait_event_type = 'Lock'"))

    def keep_up(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """One round of what a worker does beside its jobs, as of one that has just started.

        meanwhile: what comes between its look at the queue and its hand on a dead worker's name.
        """
        settings, desk = self.service.settings, WorkDesk(self.database, self.vault)
        bench = Workbench(desk, self.vault, ForkServer(), JobSettings(Limits(), TaskNames(), lambda: None))
        desks = Desks(desk, Privacy(self.database, self.vault), Sharing(self.database))
        locks = open_locks(settings.jobs_database, settings.data_dir)
        take, own_name = locks.try_take, "worker-beside"
        assert take(own_name)
        upkeep = Upkeep(Known(own_name, "none", {}), bench, desks, settings)

        def try_late(name: str) -> bool:
            meanwhile()
            return take(name)

        with patch.object(locks, "try_take", try_late):
            upkeep.run(locks, (), _OneRound())
        locks.close()

    def crew(self, size: int = 1) -> list[Worker]:
        """So many living workers and no more, all of them ready."""
        living = [process for process in self.service.processes if process.poll() is None]
        for surplus in living[size:]:
            kill(surplus)
        started = [self.service.start_worker(on_a_leash=True) for _ in range(size - len(living))]
        self.says('"a worker is ready"', times=len(self.service.processes))
        return [*living[:size], *started]

    def starts(self, case: str) -> int:
        """How often workers took its job up."""
        with self.database.reading() as session:
            return int(session.scalar(sa.select(CaseRow.job_starts).where(CaseRow.id == case)) or 0)

    def wait_until_at_work(self, case: str, start: int = 1) -> None:
        """Until its job runs, for the so many-th time."""
        eventually(lambda: self.starts(case) == start and self.state(case).stage == "fit", PATIENCE_S)

    def wait_until(self, case: str, status: str) -> None:
        """Until the case has come there."""
        eventually(lambda: self.state(case).status == status, PATIENCE_S)

    def wait_until_examined(self, case: str) -> None:
        """Until its check went well."""
        self.wait_until(case, "awaiting_landmarks")

    def said(self, words: str) -> int:
        """How often the log has these words."""
        return self.service.log.read_text().count(words)

    def says(self, words: str, times: int = 1) -> None:
        """Wait until the log has these words so often."""
        eventually(lambda: self.said(words) >= times, PATIENCE_S)


class _OneRound(threading.Event):
    def wait(self, timeout: float | None = None) -> bool:
        self.set()
        return True


def _word(event: CaseEventRow) -> str:
    return str(event.data["status"]) if event.kind == "status" else f"stage {event.data['stage']}"


def kill(worker: Worker) -> None:
    """It has no chance to put anything in order."""
    worker.kill()
    worker.wait()


def let_go(worker: Worker) -> None:
    """What the system does to it when the server that started it is killed."""
    assert worker.stdin is not None
    worker.stdin.close()


def children_of(pid: int) -> list[int]:
    """The processes that this one started."""
    lists = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for found in lists for child in found.read_text().split()]


def at_work(worker: Worker) -> list[int]:
    """The confined children in which a worker's jobs run at this moment."""
    (warm,) = children_of(worker.pid)
    return children_of(warm)


@contextmanager
def watched(pid: int) -> Iterator[Callable[[float], bool]]:
    """Tells whether a process ends within so many seconds; the kernel says when."""
    end = os.pidfd_open(pid)
    waiting = select.poll()
    waiting.register(end, select.POLLIN)
    try:
        yield lambda seconds: bool(waiting.poll(seconds * 1000))
    finally:
        os.close(end)


@contextmanager
def open_desk(database_url: str, folder: Path, **settings: Any) -> Iterator[Desk]:
    """A desk in a folder of its own; its workers are stopped at the end."""
    told = Settings(**{"data_dir": folder / "data", "port": free_port(), "database_url": database_url} | settings)
    database = Database(told.database)
    vault = FileVault(database, told.store, told.master_key_source)
    family = People(database).open_session(1.0)
    service = Service(told)
    engine = DbosEngine(told.jobs_database)
    try:
        yield Desk(service, database, CaseStore(database, vault), vault, engine, family.actor, folder / "gate")
    finally:
        service.stop()
        engine.close()
        database.close()
