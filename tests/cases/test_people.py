"""Keys and sessions: known by their hashes, scoped, ended for good."""

from __future__ import annotations

from pathlib import Path

import pytest
import sqlalchemy as sa

from lubdub.cases import admin
from lubdub.cases.models import FamilySessionRow, PortalKeyRow
from tests.cases.conftest import Room


def test_a_key_is_shown_once_and_stored_as_a_hash(room: Room) -> None:
    key, token = room.people.create_key("clinic", ["cases:read"])
    found = room.people.key_of(token)
    assert found is not None
    assert (found.id, found.scopes) == (key.id, ("cases:read",))
    assert token.startswith(key.prefix)
    with room.database.reading() as session:
        row = session.execute(sa.select(PortalKeyRow.__table__)).one()
    assert token not in " ".join(map(str, row))


def test_a_revoked_key_and_an_unknown_one_open_nothing(room: Room) -> None:
    key, token = room.people.create_key("clinic", ["cases:read"])
    assert room.people.revoke_key(key.id)
    assert room.people.key_of(token) is None
    assert room.people.key_of("lubdub_guess") is None
    assert not room.people.revoke_key(key.id)


def test_using_a_key_is_remembered(room: Room) -> None:
    _, token = room.people.create_key("clinic", ["cases:read"])
    assert room.people.list_keys()[0].last_used_at is None
    room.people.key_of(token)
    assert room.people.list_keys()[0].last_used_at is not None


@pytest.mark.parametrize("scopes", [["cases:all"], []])
def test_a_scope_that_does_not_exist_is_refused(room: Room, scopes: list[str]) -> None:
    with pytest.raises(ValueError, match="cases:read"):
        room.people.create_key("clinic", scopes)


def test_a_session_is_known_by_its_cookie_until_it_ends(room: Room) -> None:
    session = room.people.open_session(1.0)
    found = room.people.session_of(session.token)
    assert found is not None
    assert found.id == session.id
    with room.database.reading() as reading:
        row = reading.execute(sa.select(FamilySessionRow.__table__)).one()
    assert session.token not in " ".join(map(str, row))
    room.people.end_session(session.id)
    assert room.people.session_of(session.token) is None


def test_keys_are_managed_by_command(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'cases.sqlite'}"
    key, token = admin.create_key(url, "clinic")
    assert token.startswith("lubdub_")
    assert [known.id for known in admin.list_keys(url)] == [key.id]
    assert admin.revoke_key(url, key.id)
    assert admin.list_keys(url)[0].revoked_at is not None
