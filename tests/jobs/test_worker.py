"""Workers that are killed at work: nothing is lost, nothing is done twice. Real processes, both databases."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import timedelta

import pytest
import sqlalchemy as sa

from lubdub.jobs.alive import why_not
from lubdub.jobs.upkeep import KEPT_IN_QUEUE
from tests.databases import fresh_database, kinds
from tests.jobs.desk import ONCE, PATIENCE_S, Desk, at_work, kill, let_go, open_desk
from tests.web.service import eventually

EXAMINED = ["examination.json", "examination.npz", "scan", "scan.ply"]


@pytest.fixture(scope="module", params=kinds())
def running(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    folder = tmp_path_factory.mktemp("workers")
    with fresh_database(request.param, folder) as url, open_desk(url, folder, worker_pulse=folder / "pulse") as opened:
        yield opened


@pytest.fixture
def desk(running: Desk) -> Desk:
    """With its gate closed."""
    running.gate.unlink(missing_ok=True)
    return running


def test_a_job_whose_worker_is_killed_is_finished_once_after_restart(desk: Desk) -> None:
    case = desk.send()  # no worker was ever here: the queue has no tables yet, the row must do
    (first,) = desk.crew()
    desk.wait_until_at_work(case)
    kill(first)
    assert desk.state(case).status == "checking"
    desk.gate.touch()
    desk.crew()
    desk.wait_until_examined(case)
    assert desk.statuses(case) == ONCE


def test_a_worker_shows_its_containers_health_check_that_it_does_its_rounds(desk: Desk) -> None:
    settings = desk.service.settings
    assert settings.worker_pulse is not None
    desk.crew()
    settings.worker_pulse.unlink(missing_ok=True)
    assert why_not(settings) is not None
    eventually(lambda: why_not(settings) is None)


def test_a_job_of_a_dead_worker_is_taken_over_by_a_living_one_within_ten_seconds(desk: Desk) -> None:
    workers = desk.crew(2)
    case, job = desk.receive()
    desk.engine.submit(job)
    desk.wait_until_at_work(case)
    (busy,) = (worker for worker in workers if at_work(worker))

    def the_other_one_is_quicker() -> None:
        kill(busy)
        desk.wait_until_at_work(case, start=2)

    desk.keep_up(meanwhile=the_other_one_is_quicker)
    assert desk.engine.states([job.id]) == {job.id: "running"}, "who comes too late leaves it to the other one"
    desk.gate.touch()
    desk.wait_until_examined(case)
    assert desk.longest_silence(case) < timedelta(seconds=10)
    assert (desk.starts(case), desk.statuses(case), desk.files(case)) == (2, ONCE, EXAMINED)
    assert len(desk.objects(case)) == len(EXAMINED)
    assert "taken over" in desk.service.log.read_text()


def test_a_worker_killed_between_its_files_and_the_commit_hands_in_once_and_leaves_nothing(desk: Desk) -> None:
    (worker,) = desk.crew()
    case = desk.send(f"quietly {desk.gate}")
    desk.wait_until_at_work(case)
    with desk.held(case):
        desk.gate.touch()
        eventually(lambda: len(desk.objects(case)) == len(EXAMINED), PATIENCE_S)
        assert desk.files(case) == ["scan"]
        kill(worker)
    desk.crew()
    desk.wait_until_examined(case)
    assert (desk.starts(case), desk.statuses(case), desk.files(case)) == (2, ONCE, EXAMINED)
    desk.delete(case)
    assert desk.objects(case) == [], "what the first one left behind goes with the case"


def test_a_worker_killed_after_the_commit_and_before_the_queue_knows_changes_nothing_twice(desk: Desk) -> None:
    (worker,) = desk.crew()
    case, job = desk.receive(f"quietly {desk.gate}")
    desk.engine.submit(job)
    desk.wait_until_at_work(case)
    with desk.unheard(job.id):
        desk.gate.touch()
        desk.wait_until_examined(case)
        kill(worker)
    assert desk.engine.states([job.id]) == {job.id: "running"}
    told = desk.story(case)
    desk.crew()
    eventually(lambda: desk.engine.states([job.id]) == {job.id: "ended"}, PATIENCE_S)
    assert desk.story(case) == told
    assert (desk.starts(case), desk.files(case), len(desk.objects(case))) == (1, EXAMINED, len(EXAMINED))


def test_a_worker_whose_server_is_killed_stops_and_leaves_its_job_to_the_next(desk: Desk) -> None:
    (worker,) = desk.crew()
    case = desk.send()
    desk.wait_until_at_work(case)
    let_go(worker)
    assert worker.wait(60) == 0
    assert desk.starts(case) == 0, "an orderly stop is no fault of the job"
    assert desk.state(case).status == "checking"
    desk.gate.touch()
    desk.crew()
    desk.wait_until_examined(case)


def test_the_queue_forgets_jobs_that_ended_long_ago_and_no_others(desk: Desk) -> None:
    desk.crew()
    (_, old), (_, young), (_, waiting) = jobs = [desk.receive(order) for order in ("quick", "quick", None)]
    for _, job in jobs:
        desk.engine.submit(job)
    desk.wait_until_at_work(waiting.case_id)
    eventually(lambda: set(desk.engine.states([old.id, young.id]).values()) == {"ended"}, PATIENCE_S)
    with desk.queue() as (queue, rows):
        before = queue.scalar(sa.select(sa.func.count()).select_from(rows))
        long_ago = rows.c.completed_at - 1000 * KEPT_IN_QUEUE // timedelta(seconds=1)
        queue.execute(rows.update().where(rows.c.workflow_uuid == old.id).values(completed_at=long_ago))
    desk.keep_up()
    known = desk.engine.states([old.id, young.id, waiting.id])
    assert known == {old.id: "unknown", young.id: "ended", waiting.id: "running"}
    with desk.queue() as (queue, rows):
        assert queue.scalar(sa.select(sa.func.count()).select_from(rows)) == before - 1
    desk.gate.touch()
    desk.wait_until_examined(waiting.case_id)
    assert desk.statuses(old.case_id) == ONCE
