"""Answers before the case: sealed, one set for each browser, and gone when they should be."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
import sqlalchemy as sa

from lubdub.cases.drafts import Drafts
from lubdub.cases.errors import SealBroken
from lubdub.cases.models import CaseRow, DraftRow
from lubdub.cases.values import Consent, Guide
from tests.cases.conftest import Room, girl_of_six

ANSWERS = {"who": "child", "years": "6", "heart_on_right": "unsure"}


def test_answers_are_kept_for_their_own_session_and_replaced_by_newer_ones(room: Room) -> None:
    drafts = Drafts(room.database, room.vault)
    ours, others = room.people.open_session(1.0), room.people.open_session(1.0)
    assert drafts.read(ours) == {}
    drafts.write(ours, {"who": "self"})
    drafts.write(ours, ANSWERS)
    assert drafts.read(ours) == ANSWERS
    assert drafts.read(others) == {}
    drafts.forget(ours)
    assert drafts.read(ours) == {}


def test_the_database_never_holds_an_answer_in_the_clear(room: Room) -> None:
    drafts, ours = Drafts(room.database, room.vault), room.people.open_session(1.0)
    drafts.write(ours, ANSWERS)
    with room.database.reading() as session:
        sealed = session.scalars(sa.select(DraftRow.sealed)).one()
    assert b"heart" not in sealed
    assert b"unsure" not in sealed


def test_one_sessions_answers_do_not_open_in_another(room: Room) -> None:
    drafts = Drafts(room.database, room.vault)
    ours, others = room.people.open_session(1.0), room.people.open_session(1.0)
    drafts.write(ours, ANSWERS)
    with room.database.writing() as session:
        session.execute(sa.update(DraftRow).values(session_id=others.id))
    with pytest.raises(SealBroken):
        drafts.read(others)


def test_answers_of_an_ended_session_are_purged(room: Room) -> None:
    drafts, living, ended = (
        Drafts(room.database, room.vault),
        room.people.open_session(1.0),
        room.people.open_session(0),
    )
    for session in (living, ended):
        drafts.write(session, ANSWERS)
    room.privacy.purge(retention_days=7)
    with room.database.reading() as session:
        assert list(session.scalars(sa.select(DraftRow.session_id))) == [living.id]


def test_consent_stands_in_the_case_and_goes_with_it(room: Room) -> None:
    actor = room.family()
    given = Consent("1", "en", datetime(2026, 1, 2, 3, 4, tzinfo=UTC), "agreed")
    case, _ = room.store.create(actor, girl_of_six(person="self", consent=given))
    assert room.store.get(actor, case.id).person == "self"
    assert case.consent == {
        "version": "1",
        "language": "en",
        "given_at": "2026-01-02T03:04:00+00:00",
        "child": "agreed",
    }
    room.privacy.delete(actor, case.id)
    with room.database.reading() as session:
        row = session.get(CaseRow, case.id)
        assert row is not None
        assert (row.person, row.consent, row.guide_app) == ("", None, None)


def test_how_far_the_instructions_were_read_is_remembered(room: Room) -> None:
    actor = room.family()
    case, _ = room.store.create(actor, girl_of_six())
    assert case.guide == Guide()
    room.store.note_guide(actor, case.id, Guide("polycam", is_read=True))
    assert room.store.get(actor, case.id).guide == Guide("polycam", is_read=True)
