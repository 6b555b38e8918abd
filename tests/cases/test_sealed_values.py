"""Places on a body are sealed in the database, too; what an older version kept plain is sealed when it is found."""

from __future__ import annotations

import json

import pytest
import sqlalchemy as sa

from lubdub.cases.errors import FileNotFound
from lubdub.cases.models import CaseRow
from lubdub.cases.sealed_values import opened, seal_older, sealed
from lubdub.cases.store import Asked
from tests.cases.conftest import Room
from tests.cases.test_store import with_scan

NAVEL = {"navel": [123456.789, 2.0, 3.0]}


def kept(room: Room, case_id: str) -> str:
    with room.database.reading() as session:
        return str(session.scalar(sa.select(sa.cast(CaseRow.landmarks, sa.Text)).where(CaseRow.id == case_id)))


def test_landmarks_are_read_as_they_were_placed_and_stand_sealed_in_the_database(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    room.store.place_landmarks(actor, case.id, Asked(NAVEL))
    assert room.store.get(actor, case.id).landmarks == NAVEL
    assert "123456" not in kept(room, case.id)
    assert "navel" not in kept(room, case.id)


def test_what_an_older_version_kept_plain_is_read_and_then_sealed(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    with room.database.writing() as session:
        session.get_one(CaseRow, case.id).landmarks = NAVEL
    assert json.loads(kept(room, case.id)) == NAVEL
    assert room.store.get(actor, case.id).landmarks == NAVEL
    assert seal_older(room.database) == 1
    assert seal_older(room.database) == 0
    assert "123456" not in kept(room, case.id)
    assert room.store.get(actor, case.id).landmarks == NAVEL


def test_a_sealed_value_opens_with_its_own_case_alone_and_not_after_its_deletion(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    with room.database.writing() as session:
        value = sealed(session, case.id, NAVEL)
        assert opened(session, case.id, value) == NAVEL
    room.privacy.delete(actor, case.id)
    with room.database.reading() as session, pytest.raises(FileNotFound):
        opened(session, case.id, value)
