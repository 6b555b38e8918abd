"""The fair order of jobs: nobody waits for more than one job of each of the others."""

from __future__ import annotations

import pytest

from lubdub.cases.values import Actor, Job
from lubdub.cases.work import Handed
from tests.cases.conftest import Room, girl_of_six, room

__all__ = ["room"]
pytestmark = pytest.mark.parametrize("room", ["sqlite"], indirect=True)


def ask(room: Room, actor: Actor) -> Job:
    case, _ = room.store.create(actor, girl_of_six())
    return room.store.receive_scan(actor, case.id, room.vault.seal(case.id, "scan", b"skin"), "mm")[1]


def end(room: Room, job: Job) -> None:
    assert room.desk.hand_in(job, Handed("failed", reason={"code": "internal", "message": "m", "advice": "a"}))


def test_the_jobs_of_one_portal_go_one_after_the_other(room: Room) -> None:
    portal = room.portal()
    assert [ask(room, portal).turn for _ in range(4)] == [1, 2, 3, 4]


def test_who_comes_later_with_one_job_goes_before_the_rest_of_a_hundred(room: Room) -> None:
    many = room.portal("many")
    hundred = [ask(room, many) for _ in range(100)]
    assert ask(room, room.portal("one")).turn == hundred[0].turn
    for job in hundred[:40]:
        end(room, job)
    assert ask(room, room.portal("two")).turn <= hundred[40].turn


def test_who_comes_again_and_again_does_not_keep_a_hundred_waiting(room: Room) -> None:
    hundred = [ask(room, room.portal("many")) for _ in range(5)]
    again = room.portal("again")
    turns = []
    for waiting in hundred:
        job = ask(room, again)
        turns.append(job.turn)
        end(room, waiting)
        end(room, job)
    assert turns == [job.turn for job in hundred]


def test_every_family_is_one_owner(room: Room) -> None:
    one, other = room.family(), room.family()
    assert [ask(room, one).turn for _ in range(3)] == [1, 2, 3]
    assert ask(room, other).turn == 1


def test_when_nothing_is_at_work_turns_begin_anew(room: Room) -> None:
    portal = room.portal()
    for job in [ask(room, portal) for _ in range(3)]:
        end(room, job)
    assert ask(room, portal).turn == 1
