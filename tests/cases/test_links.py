"""Hand-off links: they move a case once, for a short time, and are stored only as hashes."""

from __future__ import annotations

from datetime import timedelta

import pytest
import sqlalchemy as sa

from lubdub.cases import links as links_room
from lubdub.cases.errors import CaseNotFound, LinkSpent
from lubdub.cases.links import Links
from lubdub.cases.models import AuditRow, LinkRow
from tests.cases.conftest import Room, girl_of_six


def test_a_link_moves_the_case_to_the_other_device_once(room: Room) -> None:
    computer, phone, third = (room.people.open_session(1.0).actor for _ in range(3))
    links = Links(room.database)
    case, _ = room.store.create(computer, girl_of_six())
    code = links.offer(computer, case.id).code
    assert links.is_open(code)
    assert links.take(phone, code.lower().replace("-", " ")).id == case.id
    assert room.store.get(phone, case.id).id == case.id
    with pytest.raises(CaseNotFound):
        room.store.get(computer, case.id)
    assert not links.is_open(code)
    with pytest.raises(LinkSpent):
        links.take(third, code)


def test_the_case_comes_back_the_same_way(room: Room) -> None:
    computer, phone = (room.people.open_session(1.0).actor for _ in range(2))
    links = Links(room.database)
    case, _ = room.store.create(computer, girl_of_six())
    links.take(phone, links.offer(computer, case.id).code)
    with pytest.raises(CaseNotFound):
        links.offer(computer, case.id)
    links.take(computer, links.offer(phone, case.id).code)
    assert room.store.get(computer, case.id).id == case.id


def test_an_old_link_does_not_work(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    computer, phone = (room.people.open_session(1.0).actor for _ in range(2))
    links = Links(room.database)
    case, _ = room.store.create(computer, girl_of_six())
    monkeypatch.setattr(links_room, "LASTS", timedelta(seconds=-1))
    code = links.offer(computer, case.id).code
    with pytest.raises(LinkSpent):
        links.take(phone, code)
    room.privacy.purge(retention_days=7)
    with room.database.reading() as session:
        assert session.scalars(sa.select(LinkRow)).all() == []


def test_a_newer_link_ends_the_older_one_and_a_deleted_case_has_none(room: Room) -> None:
    computer, phone = (room.people.open_session(1.0).actor for _ in range(2))
    links = Links(room.database)
    case, _ = room.store.create(computer, girl_of_six())
    older, newer = links.offer(computer, case.id).code, links.offer(computer, case.id).code
    with pytest.raises(LinkSpent):
        links.take(phone, older)
    room.privacy.delete(computer, case.id)
    with pytest.raises(LinkSpent):
        links.take(phone, newer)


def test_the_database_holds_no_code_and_the_audit_says_who_took_it(room: Room) -> None:
    computer, phone = (room.people.open_session(1.0).actor for _ in range(2))
    links = Links(room.database)
    case, _ = room.store.create(computer, girl_of_six())
    code = links.offer(computer, case.id).code
    links.take(phone, code)
    with room.database.reading() as session:
        row = session.scalars(sa.select(LinkRow)).one()
        told = {line.action: line.actor for line in session.scalars(sa.select(AuditRow))}
    assert code.replace("-", "") not in {row.id, row.token_sha256}
    assert told["handoff.offer"] == computer.name
    assert told["handoff.take"] == phone.name
