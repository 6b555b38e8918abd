"""Workers that are killed at work: nothing is lost, nothing is done twice. Real processes, both databases."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.people import People
from lubdub.cases.store import CaseStore
from lubdub.cases.values import Actor, Case
from lubdub.jobs.engine import DbosEngine
from lubdub.settings import Settings
from tests.cases.conftest import girl_of_six
from tests.databases import fresh_database, kinds
from tests.web.service import Service, eventually, free_port


@dataclass(frozen=True)
class Desk:
    """What the web process does, without one: cases come in here, workers are real."""

    service: Service
    store: CaseStore
    vault: FileVault
    engine: DbosEngine
    actor: Actor
    gate: Path
    """A job runs until this file is there."""

    def send(self) -> str:
        case, _ = self.store.create(self.actor, girl_of_six())
        scan = self.vault.seal(case.id, "scan", f"until {self.gate}".encode())
        _, job = self.store.receive_scan(self.actor, case.id, scan, None)
        self.engine.submit(job.id)
        return case.id

    def state(self, case: str) -> Case:
        return self.store.get(self.actor, case)

    def wait_until_at_work(self, case: str) -> None:
        eventually(lambda: self.state(case).stage == "fit")

    def wait_until_examined(self, case: str) -> None:
        eventually(lambda: self.state(case).status == "awaiting_landmarks")


@pytest.fixture(params=kinds())
def desk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Desk]:
    with fresh_database(request.param, tmp_path) as url:
        settings = Settings(data_dir=tmp_path / "data", port=free_port(), database_url=url)
        database = Database(settings.database)
        vault = FileVault(database, settings.store, settings.master_key_source)
        family = People(database).open_session(1.0)
        service = Service(settings)
        engine = DbosEngine(settings.jobs_database)
        try:
            yield Desk(service, CaseStore(database, vault), vault, engine, family.actor, tmp_path / "gate")
        finally:
            service.stop()
            engine.close()
            database.close()


def test_a_job_whose_worker_is_killed_is_finished_once_after_restart(desk: Desk) -> None:
    case = desk.send()  # no worker was ever here: the queue has no tables yet, the row must do
    first = desk.service.start_worker()
    desk.wait_until_at_work(case)
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert desk.state(case).status == "checking"
    desk.gate.touch()
    desk.service.start_worker()
    desk.wait_until_examined(case)
    states = [event.data["status"] for event in desk.store.events_after(desk.actor, case, 0) if event.kind == "status"]
    assert states == ["awaiting_scan", "checking", "awaiting_landmarks"]


def test_a_job_of_a_dead_worker_is_taken_over_by_a_living_one(desk: Desk) -> None:
    first = desk.service.start_worker()
    case = desk.send()
    desk.wait_until_at_work(case)
    desk.service.start_worker()
    eventually(lambda: desk.service.log.read_text().count('"a worker is ready"') == 2)
    first.send_signal(signal.SIGKILL)
    first.wait()
    desk.gate.touch()
    desk.wait_until_examined(case)
    assert "taken over" in desk.service.log.read_text()


@pytest.mark.parametrize("desk", ["sqlite"], indirect=True)
def test_a_worker_told_to_stop_leaves_its_job_to_the_next(desk: Desk) -> None:
    worker = desk.service.start_worker()
    case = desk.send()
    desk.wait_until_at_work(case)
    worker.terminate()
    assert worker.wait(20) == 0
    assert desk.state(case).status == "checking"
    desk.gate.touch()
    desk.service.start_worker()
    desk.wait_until_examined(case)
