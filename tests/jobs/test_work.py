"""What a child's end means for its case, with a stand-in for the child."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from sqlalchemy.exc import OperationalError

from lubdub.cases.files import Sealed
from lubdub.cases.store import Asked
from lubdub.cases.values import Actor, Job
from lubdub.cases.work import MAX_STARTS
from lubdub.jobs.bundle import Bundle
from lubdub.jobs.forkserver import ForkServerFailed
from lubdub.jobs.sandbox import ChildResult, Limits
from lubdub.jobs.work import BREAKS_READER, COME_BACK, FAILED, JobSettings, TaskNames, Workbench
from lubdub.results import Progress
from tests.cases.conftest import Room, girl_of_six, room

__all__ = ["room"]
pytestmark = pytest.mark.parametrize("room", ["sqlite"], indirect=True)

EXAMINED = Bundle({}, {"examination.npz": b"npz", "examination.json": b"{}", "scan.ply": b"ply", "../evil": b"x"})
LOCATED = Bundle({"verdict": "show", "reason": None}, {"result.json": b"{}", "outcome.npz": b"npz", "scan": b"other"})
REASON = {"code": "mirrored_scan", "message": "m", "advice": "a"}
REFUSED = Bundle({"verdict": "refuse", "reason": REASON}, {"result.json": b"{}", "outcome.npz": b"npz"})


@dataclass
class StandIn:
    """Ends every job the same way, after doing what it is told meanwhile."""

    ends: ChildResult | Exception
    meanwhile: Callable[[], object] = lambda: None
    asked: list[tuple[str, Bundle]] = field(default_factory=list)
    progress: int = 1

    def run(
        self, task: str, payload: bytes, limits: Limits, on_progress: Progress, cancelled: Callable[[], bool] = bool
    ) -> ChildResult:
        self.asked.append((task, Bundle.from_bytes(payload)))
        for step in range(self.progress):
            on_progress("fit", step / self.progress)
        self.meanwhile()
        if cancelled():
            return ChildResult("cancelled")
        if isinstance(self.ends, Exception):
            raise self.ends
        return self.ends


def bench(room: Room, child: StandIn) -> Workbench:
    return Workbench(
        room.desk, room.vault, child, JobSettings(Limits(), TaskNames("t:check", "t:locate"), lambda: None)
    )


def check_job(room: Room) -> tuple[Actor, Job]:
    actor = room.family()
    case, _ = room.store.create(actor, girl_of_six())
    _, job = room.store.receive_scan(actor, case.id, room.vault.seal(case.id, "scan", b"skin"), "mm")
    return actor, job


def locate_job(room: Room) -> tuple[Actor, Job]:
    actor, check = check_job(room)
    bench(room, StandIn(ChildResult("ok", EXAMINED.to_bytes()))).do(check.id)
    return actor, room.store.place_landmarks(actor, check.case_id, Asked({"navel": [1.0, 2.0, 3.0]}))[1]


def test_a_child_taken_away_by_our_own_stop_hands_in_nothing(room: Room) -> None:
    actor, job = check_job(room)
    child = StandIn(ForkServerFailed("the process that reads scans died at work; try again"))
    stopped = bench(room, child)
    child.meanwhile = stopped.close
    stopped.do(job.id)
    assert room.store.get(actor, job.case_id).status == "checking"
    room.desk.put_back(job)
    bench(room, StandIn(ChildResult("ok", EXAMINED.to_bytes()))).do(job.id)
    assert room.store.get(actor, job.case_id).status == "awaiting_landmarks"


def test_the_child_gets_the_scan_and_what_was_said_and_nothing_that_names_the_case(room: Room) -> None:
    _, job = locate_job(room)
    child = StandIn(ChildResult("ok", LOCATED.to_bytes()))
    bench(room, child).do(job.id)
    ((task, asked),) = child.asked
    assert task == "t:locate"
    assert dict(asked.parts) == {"scan": b"skin"}
    assert asked.facts["landmarks"] == {"navel": [1.0, 2.0, 3.0]}
    assert (asked.facts["age_years"], asked.facts["unit"]) == (6.0, "mm")
    assert job.case_id not in json.dumps(dict(asked.facts))


@pytest.mark.parametrize(
    ("ends", "status", "code"),
    [
        (ChildResult("ok", EXAMINED.to_bytes()), "awaiting_landmarks", None),
        (ChildResult("refused", json.dumps(REASON).encode()), "refused", "mirrored_scan"),
        (ChildResult("unreadable", json.dumps(BREAKS_READER.to_json()).encode()), "refused", "unreadable_file"),
        (ChildResult("crashed"), "refused", "unreadable_file"),
        (ChildResult("memory"), "refused", "unreadable_file"),
        (ChildResult("timeout"), "refused", "unreadable_file"),
        (ChildResult("ok", b"what a hijacked child might say"), "refused", "unreadable_file"),
        (ChildResult("refused", b'["no reason"]'), "failed", "internal"),
        (ChildResult("error"), "failed", "internal"),
        (RuntimeError("the fork server died"), "failed", "internal"),
    ],
)
def test_however_a_check_ends_the_case_says_so(
    room: Room, ends: ChildResult | Exception, status: str, code: str | None
) -> None:
    actor, job = check_job(room)
    bench(room, StandIn(ends)).do(job.id)
    case = room.store.get(actor, job.case_id)
    assert case.status == status
    assert (case.reason or {}).get("code") == code


@pytest.mark.parametrize(("bundle", "status"), [(LOCATED, "done"), (REFUSED, "refused")])
def test_a_run_ends_as_its_verdict_says(room: Room, bundle: Bundle, status: str) -> None:
    actor, job = locate_job(room)
    bench(room, StandIn(ChildResult("ok", bundle.to_bytes()))).do(job.id)
    case = room.store.get(actor, job.case_id)
    assert (case.status, case.reason) == (status, bundle.facts["reason"])
    assert room.vault.read(job.case_id, "scan") == b"skin"


def test_a_cancelled_job_hands_nothing_in(room: Room) -> None:
    actor, job = locate_job(room)
    child = StandIn(ChildResult("ok", LOCATED.to_bytes()), lambda: room.store.cancel(actor, job.case_id))
    bench(room, child).do(job.id)
    assert room.store.get(actor, job.case_id).status == "awaiting_landmarks"


def test_a_job_of_a_deleted_case_ends_quietly(room: Room) -> None:
    actor, job = check_job(room)
    child = StandIn(ChildResult("ok", EXAMINED.to_bytes()), lambda: room.privacy.delete(actor, job.case_id))
    bench(room, child).do(job.id)
    assert not [path for path in (room.folder / "files").rglob("*") if path.is_file()]


def test_a_job_that_nobody_waits_for_is_not_started(room: Room) -> None:
    actor, job = check_job(room)
    room.store.cancel(actor, job.case_id)
    child = StandIn(ChildResult("ok", EXAMINED.to_bytes()))
    bench(room, child).do(job.id)
    assert child.asked == []


def test_a_job_done_again_after_a_crash_changes_nothing_twice(room: Room) -> None:
    actor, job = locate_job(room)
    work = bench(room, StandIn(ChildResult("ok", LOCATED.to_bytes())))
    work.do(job.id)
    told = room.store.events_after(actor, job.case_id, 0)
    work.do(job.id)
    assert room.store.events_after(actor, job.case_id, 0) == told


def test_progress_within_a_stage_is_told_now_and_then(room: Room) -> None:
    actor, job = check_job(room)
    bench(room, StandIn(ChildResult("ok", EXAMINED.to_bytes()), progress=2000)).do(job.id)
    told = [event for event in room.store.events_after(actor, job.case_id, 0, 5000) if event.kind == "progress"]
    assert 1 <= len(told) < 200


def test_a_job_given_up_is_told_as_a_fault_of_ours(room: Room) -> None:
    actor, job = check_job(room)
    bench(room, StandIn(ChildResult("ok"))).give_up(job)
    case = room.store.get(actor, job.case_id)
    assert case.status == "failed"
    assert case.reason is not None
    assert case.reason["code"] == "internal"


def test_a_database_that_is_away_while_a_job_runs_does_not_end_it(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    actor, job = check_job(room)

    def is_away(*_: object, **__: object) -> bool:
        raise OperationalError("tell", {}, OSError("the server closed the connection"))

    with monkeypatch.context() as away:
        away.setattr(room.desk, "tell", is_away)
        away.setattr(room.desk, "is_current", is_away)
        ends = StandIn(ChildResult("ok", EXAMINED.to_bytes()), meanwhile=away.undo, progress=3)
        bench(room, ends).do(job.id)
    assert room.store.get(actor, job.case_id).status == "awaiting_landmarks"


def test_a_result_that_the_store_does_not_take_ends_the_job_with_come_back_later(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    actor, job = check_job(room)
    monkeypatch.setattr("lubdub.jobs.work.STORE_PATIENCE_S", 0.0)

    def is_full(*_: object) -> Sealed:
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(room.vault, "seal", is_full)
    bench(room, StandIn(ChildResult("ok", EXAMINED.to_bytes()))).do(job.id)
    case = room.store.get(actor, job.case_id)
    assert (case.status, case.reason) == ("failed", COME_BACK.to_json())


def test_a_job_taken_up_too_often_is_given_up_without_another_try(room: Room) -> None:
    actor, job = check_job(room)
    for _ in range(MAX_STARTS):
        room.desk.take_up(job)
    child = StandIn(ChildResult("ok", EXAMINED.to_bytes()))
    bench(room, child).do(job.id)
    assert child.asked == []
    assert room.store.get(actor, job.case_id).reason == FAILED.to_json()


def test_a_start_that_was_put_back_does_not_count(room: Room) -> None:
    _, job = check_job(room)
    for _ in range(MAX_STARTS + 2):
        assert room.desk.take_up(job) is not None
        room.desk.put_back(job)


def test_a_new_job_of_the_same_case_has_all_its_tries(room: Room) -> None:
    actor, job = check_job(room)
    for _ in range(MAX_STARTS):
        room.desk.take_up(job)
    bench(room, StandIn(ChildResult("ok"))).do(job.id)
    _, again = room.store.check_again(actor, job.case_id, "mm")
    assert room.desk.take_up(again) is not None
