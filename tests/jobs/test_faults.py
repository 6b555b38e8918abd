"""What fails around a job: the database dies, a job is poison, somebody cancels, one tenant asks for very much.

Real processes; every case here ends as it should have, once, or as failed with a reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from lubdub.cases.work import MAX_STARTS
from lubdub.jobs.work import FAILED
from tests.databases import fresh_database, kinds
from tests.jobs.desk import ONCE, Desk, at_work, kill, open_desk, watched
from tests.postgres import PostgresServer, own_postgres, programs

with_own_postgres = pytest.mark.skipif(programs() is None, reason="PostgreSQL's server is not installed here")


@pytest.fixture(scope="module", params=kinds())
def running(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    folder = tmp_path_factory.mktemp("faults")
    with fresh_database(request.param, folder) as url, open_desk(url, folder) as opened:
        yield opened


@pytest.fixture
def desk(running: Desk) -> Desk:
    """With its gate closed."""
    running.gate.unlink(missing_ok=True)
    return running


@pytest.fixture(scope="module")
def mortal(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[PostgresServer, Desk]]:
    folder = tmp_path_factory.mktemp("mortal")
    with own_postgres() as server, server.database() as url, open_desk(url, folder) as opened:
        yield server, opened


@with_own_postgres
def test_a_job_at_work_outlives_the_death_of_its_database(mortal: tuple[PostgresServer, Desk]) -> None:
    server, desk = mortal
    (worker,) = desk.crew()
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
    (first,) = desk.crew()
    server.kill()
    desk.says("upkeep failed", times=desk.said("upkeep failed") + 1)
    known_again = desk.said("upkeep works again") + 1
    server.start()
    desk.wait_until_examined(desk.send("quick"))
    desk.says("upkeep works again", times=known_again)  # until then its name is free for whoever starts
    desk.crew(2)
    desk.says('"worker": "worker-1"')
    assert first.poll() is None


def test_a_poisonous_job_stops_after_its_tries(desk: Desk) -> None:
    case = desk.send()
    for start in range(1, MAX_STARTS + 1):
        (worker,) = desk.crew()
        desk.wait_until_at_work(case, start)
        kill(worker)
    desk.crew()
    desk.wait_until(case, "failed")
    assert desk.state(case).reason == FAILED.to_json()
    assert desk.starts(case) == MAX_STARTS


def cancel(desk: Desk, case: str) -> None:
    desk.store.cancel(desk.actor, case)


@pytest.mark.parametrize("no_longer_wanted", [cancel, Desk.delete])
def test_a_job_that_nobody_wants_any_more_is_ended_within_a_second_of_the_answer(
    desk: Desk, no_longer_wanted: Callable[[Desk, str], None]
) -> None:
    (worker,) = desk.crew()
    case = desk.send()
    desk.wait_until_at_work(case)
    (child,) = at_work(worker)
    with watched(child) as ends_within:
        no_longer_wanted(desk, case)
        assert ends_within(1.0)


def test_who_asks_for_very_much_does_not_keep_another_waiting(desk: Desk) -> None:
    desk.crew()
    much, little = desk.portal("much"), desk.portal("little")
    first = desk.send(actor=much)
    desk.wait_until_at_work(first)
    many = [desk.send("quick", much) for _ in range(12)]
    one = desk.send("quick", little)
    desk.gate.touch()
    for case in (*many, one):
        desk.wait_until_examined(case)
    ended = {case: desk.state(case).updated_at for case in (*many, one)}
    assert sorted(ended, key=lambda case: ended[case]).index(one) <= 1


def test_a_job_the_web_process_could_not_tell_of_is_found(desk: Desk) -> None:
    """As when that process is killed between its commit and its call to the queue."""
    desk.crew()
    case, _ = desk.receive("quick")
    desk.wait_until_examined(case)
    assert desk.statuses(case) == ONCE
