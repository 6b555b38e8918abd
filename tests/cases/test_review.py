"""Sending a result to the clinician, and taking it back."""

from __future__ import annotations

import pytest
import sqlalchemy as sa

from lubdub.cases.errors import StateConflict
from lubdub.cases.models import AuditRow
from lubdub.cases.store import Asked
from lubdub.cases.values import Actor, Case
from tests.cases.conftest import Room
from tests.cases.test_store import DONE, with_scan


def with_result(room: Room, actor: Actor) -> Case:
    case = with_scan(room, actor)
    _, job = room.store.place_landmarks(actor, case.id, Asked({}))
    assert room.desk.hand_in(job, DONE)
    return room.store.get(actor, case.id)


def reviews(room: Room) -> list[str]:
    with room.database.reading() as session:
        lines = session.scalars(sa.select(AuditRow.action).order_by(AuditRow.sequence)).all()
    return [line for line in lines if line.startswith("review.")]


def test_a_result_sent_twice_was_sent_once(room: Room) -> None:
    actor = room.family()
    case = with_result(room, actor)
    assert room.store.send_for_review(actor, case.id).status == "in_review"
    assert room.store.send_for_review(actor, case.id).status == "in_review"
    assert reviews(room) == ["review.send"]
    assert [event.data["status"] for event in room.store.events_after(actor, case.id, 0)][-1] == "in_review"


def test_a_sent_result_can_be_taken_back(room: Room) -> None:
    actor = room.family()
    case = with_result(room, actor)
    room.store.send_for_review(actor, case.id)
    assert room.store.take_back(actor, case.id).status == "done"
    assert room.store.take_back(actor, case.id).status == "done"
    assert reviews(room) == ["review.send", "review.take_back"]


def test_what_was_sent_stays_as_it_was_sent_until_taken_back(room: Room) -> None:
    actor = room.family()
    case = with_result(room, actor)
    room.store.send_for_review(actor, case.id)
    with pytest.raises(StateConflict):
        room.store.place_landmarks(actor, case.id, Asked({}))
    with pytest.raises(StateConflict):
        room.store.expect_scan(actor, case.id)
    with pytest.raises(StateConflict):
        room.store.cancel(actor, case.id)
    room.store.take_back(actor, case.id)
    again, _ = room.store.place_landmarks(actor, case.id, Asked({}))
    assert again.status == "queued"


def test_without_a_result_there_is_nothing_to_send(room: Room) -> None:
    actor = room.family()
    case = with_scan(room, actor)
    with pytest.raises(StateConflict):
        room.store.send_for_review(actor, case.id)
    with pytest.raises(StateConflict):
        room.store.take_back(actor, case.id)


def test_a_sent_case_can_be_deleted(room: Room) -> None:
    actor = room.family()
    case = with_result(room, actor)
    room.store.send_for_review(actor, case.id)
    assert room.privacy.delete(actor, case.id).id == case.id
