"""What fails around a job: the database dies, a job is poison, somebody cancels, one tenant asks for very much.

Real processes; every case here ends as it should have, once, or as failed with a reason.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from lubdub.cases.work import MAX_STARTS
from lubdub.jobs.sandbox import TICK_S
from lubdub.jobs.work import FAILED, LOOK_EVERY_S
from tests.databases import fresh_database, kinds
from tests.jobs.desk import PATIENCE_S, Desk, open_desk
from tests.postgres import PostgresServer, own_postgres, programs
from tests.web.service import eventually

ONCE = ["awaiting_scan", "checking", "awaiting_landmarks"]
with_own_postgres = pytest.mark.skipif(programs() is None, reason="PostgreSQL's server is not installed here")


@pytest.fixture(params=kinds())
def desk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Desk]:
    with fresh_database(request.param, tmp_path) as url, open_desk(url, tmp_path) as opened:
        yield opened


@pytest.fixture
def mortal(tmp_path: Path) -> Iterator[tuple[PostgresServer, Desk]]:
    with own_postgres() as server, server.database() as url, open_desk(url, tmp_path) as opened:
        yield server, opened


@with_own_postgres
def test_a_job_at_work_outlives_the_death_of_its_database(mortal: tuple[PostgresServer, Desk]) -> None:
    server, desk = mortal
    worker = desk.service.start_worker()
    at_work, waiting = desk.send(), desk.send()
    desk.wait_until_at_work(at_work)
    server.kill()
    desk.says("the database is away while a job runs")
    desk.gate.touch()
    desk.says("is away and is waited for")
    server.start()
    for case in (at_work, waiting):
        desk.wait_until_examined(case)
        assert desk.statuses(case) == ONCE
    assert worker.poll() is None


@with_own_postgres
def test_after_the_death_of_the_database_a_worker_is_known_again_and_still_has_its_name(
    mortal: tuple[PostgresServer, Desk],
) -> None:
    server, desk = mortal
    first = desk.service.start_worker()
    desk.says('"a worker is ready"')
    server.kill()
    desk.says("upkeep failed")
    server.start()
    desk.gate.touch()
    desk.wait_until_examined(desk.send())
    desk.service.start_worker()
    desk.says('"worker": "worker-1"')
    assert first.poll() is None


def test_a_poisonous_job_stops_after_its_tries(desk: Desk) -> None:
    case = desk.send()
    for start in range(1, MAX_STARTS + 1):
        worker = desk.service.start_worker()
        desk.wait_until_at_work(case, start)
        worker.send_signal(signal.SIGKILL)
        worker.wait()
    desk.service.start_worker()
    desk.wait_until(case, "failed")
    assert desk.state(case).reason == FAILED.to_json()
    assert desk.starts(case) == MAX_STARTS


@pytest.mark.parametrize("desk", ["sqlite"], indirect=True)
def test_a_cancelled_job_is_ended_within_a_second_of_the_wish(desk: Desk) -> None:
    """What it takes at most is said by two settings; that it happens at all is seen by the child's end."""
    assert LOOK_EVERY_S + TICK_S < 1
    worker = desk.service.start_worker()
    case = desk.send()
    desk.wait_until_at_work(case)
    (reader,) = children_of(worker.pid)
    assert len(children_of(reader)) == 1
    desk.store.cancel(desk.actor, case)
    eventually(lambda: not children_of(reader), PATIENCE_S)
    assert desk.state(case).status == "awaiting_scan"


def children_of(pid: int) -> list[int]:
    lists = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for found in lists for child in found.read_text().split()]


def test_who_asks_for_very_much_does_not_keep_another_waiting(desk: Desk) -> None:
    much, little = desk.portal("much"), desk.portal("little")
    first = desk.send(actor=much)
    desk.service.start_worker()
    desk.wait_until_at_work(first)
    many = [desk.send("quick", much) for _ in range(12)]
    one = desk.send("quick", little)
    desk.gate.touch()
    for case in (*many, one):
        desk.wait_until_examined(case)
    ended = {case: desk.state(case).updated_at for case in (*many, one)}
    assert sorted(ended, key=lambda case: ended[case]).index(one) <= 1


@pytest.mark.parametrize("desk", ["sqlite"], indirect=True)
def test_a_job_the_web_process_could_not_tell_of_is_found(desk: Desk) -> None:
    """As when that process is killed between its commit and its call to the queue."""
    case, _ = desk.receive("quick")
    desk.service.start_worker()
    desk.wait_until_examined(case)
    assert desk.statuses(case) == ONCE
