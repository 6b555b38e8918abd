"""What the web process does, without one: cases come in here, and real workers do them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.models import CaseRow
from lubdub.cases.people import People
from lubdub.cases.store import CaseStore
from lubdub.cases.values import SYSTEM, Actor, Case, Job
from lubdub.jobs.engine import DbosEngine
from lubdub.settings import Settings
from tests.cases.conftest import girl_of_six
from tests.web.service import Service, eventually, free_port

PATIENCE_S = 120.0
"""A busy machine starts a worker slowly."""


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

    def statuses(self, case: str) -> list[str]:
        """Every state it went through, in order."""
        events = self.store.events_after(SYSTEM, case, 0)
        return [event.data["status"] for event in events if event.kind == "status"]

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

    def says(self, words: str, times: int = 1) -> None:
        """Wait until the log has these words so often."""
        eventually(lambda: self.service.log.read_text().count(words) >= times, PATIENCE_S)


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
