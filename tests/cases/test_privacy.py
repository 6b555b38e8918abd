"""Deletion: the key first, then everything else, with a receipt; and the clock that deletes by itself."""

from __future__ import annotations

import pytest
import sqlalchemy as sa

from lubdub.cases.errors import CaseNotFound, FileNotFound
from lubdub.cases.models import AuditRow, CaseEventRow, CaseKeyRow, CaseRow, FamilySessionRow, FileRow
from lubdub.cases.store import Asked
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_store import with_scan


def test_nothing_about_the_person_is_left_after_deletion(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    room.store.place_landmarks(actor, case.id, Asked({"navel": [0.0, 0.0, 0.0]}))
    receipt = room.privacy.delete(actor, case.id)
    with pytest.raises(CaseNotFound):
        room.store.get(actor, case.id)
    with pytest.raises(FileNotFound):
        room.vault.read(case.id, "scan")
    assert not [path for path in (room.folder / "files").rglob("*") if path.is_file()]
    with room.database.reading() as session:
        for table in (CaseKeyRow, FileRow, CaseEventRow):
            assert session.scalars(sa.select(table)).all() == []
        row = session.get(CaseRow, case.id)
        assert row is not None
        left = [row.age_years, row.sex, row.landmarks, row.external_id, row.reason]
        assert left == [None] * 5
        line = session.scalar(sa.select(AuditRow).where(AuditRow.action == "case.delete"))
    assert line is not None
    assert receipt.sha256 == line.sha256


def test_deletion_asked_again_gives_the_same_receipt_to_its_owner_alone(room: Room) -> None:
    actor = room.family()
    case, _ = room.store.create(actor, girl_of_six())
    receipt = room.privacy.delete(actor, case.id)
    assert room.privacy.delete(actor, case.id) == receipt
    with pytest.raises(CaseNotFound):
        room.privacy.delete(room.family(), case.id)


@pytest.mark.parametrize("room", ["sqlite"], indirect=True)
def test_the_wrapped_key_cannot_be_read_out_of_the_database_files(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    with room.database.reading() as session:
        wrapped = session.scalars(sa.select(CaseKeyRow.wrapped_key)).one()
    room.privacy.delete(actor, case.id)
    for path in room.folder.glob("cases.sqlite*"):
        assert wrapped not in path.read_bytes()


def test_retention_deletes_old_cases_and_keeps_young_ones(room: Room) -> None:
    actor = room.portal()
    old, _ = room.store.create(actor, girl_of_six())
    young, _ = room.store.create(actor, girl_of_six())
    with room.database.writing() as session:
        session.execute(
            sa.update(CaseRow).where(CaseRow.id == old.id).values(created_at=old.created_at.replace(year=2000))
        )
    receipts = room.privacy.purge(30.0)
    assert [receipt.id for receipt in receipts] == [old.id]
    assert [case.id for case in room.store.list_cases(actor)] == [young.id]
    assert room.privacy.purge(30.0) == []


def test_sessions_that_ended_without_a_case_are_forgotten(room: Room) -> None:
    idle, owner = room.people.open_session(1.0), room.people.open_session(1.0)
    room.store.create(owner.actor, girl_of_six())
    for session in (idle, owner):
        room.people.end_session(session.id)
    room.privacy.purge(30.0)
    with room.database.reading() as reading:
        assert reading.scalars(sa.select(FamilySessionRow.id)).all() == [owner.id]
