"""Workers that are killed at work: nothing is lost, nothing is done twice. Real processes, both databases."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.databases import fresh_database, kinds
from tests.jobs.desk import Desk, open_desk


@pytest.fixture(params=kinds())
def desk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Desk]:
    with fresh_database(request.param, tmp_path) as url, open_desk(url, tmp_path) as opened:
        yield opened


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
    assert desk.statuses(case) == ["awaiting_scan", "checking", "awaiting_landmarks"]


def test_a_job_of_a_dead_worker_is_taken_over_by_a_living_one(desk: Desk) -> None:
    first = desk.service.start_worker()
    case = desk.send()
    desk.wait_until_at_work(case)
    desk.service.start_worker()
    desk.says('"a worker is ready"', times=2)
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
    assert worker.wait(60) == 0
    assert desk.starts(case) == 0, "an orderly stop is no fault of the job"
    assert desk.state(case).status == "checking"
    desk.gate.touch()
    desk.service.start_worker()
    desk.wait_until_examined(case)
