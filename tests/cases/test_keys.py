"""A portal's own keys and its list of cases, on every database."""

from __future__ import annotations

from datetime import timedelta

import pytest

from lubdub.cases import keys as keys_module
from lubdub.cases.errors import KeyNotFound, StateConflict
from lubdub.cases.keys import Keys
from lubdub.cases.listing import CaseList, Wanted
from tests.cases.conftest import Room, girl_of_six


@pytest.fixture
def keys(room: Room) -> Keys:
    return Keys(room.database, room.people)


def test_a_token_ends_after_its_time_and_with_its_key(room: Room, keys: Keys, monkeypatch: pytest.MonkeyPatch) -> None:
    key, secret = room.people.create_key("clinic", ["cases:read", "cases:write"])
    granted = keys.exchange(key.id, secret, ["cases:read"])
    assert granted is not None
    known = keys.known(granted.token)
    assert known is not None
    assert (known.id, known.scopes) == (key.id, ("cases:read",))
    later = keys_module.now() + keys_module.TOKEN_LASTS
    with monkeypatch.context() as passed:
        passed.setattr(keys_module, "now", lambda: later)
        assert keys.known(granted.token) is None
    keys.revoke(key.actor, key.id)
    assert keys.known(granted.token) is None
    assert keys.exchange(key.id, secret, []) is None


def test_a_rotated_key_works_on_for_the_overlap_and_then_ends(room: Room, keys: Keys) -> None:
    key, secret = room.people.create_key("clinic", ["keys:manage"])
    newer, _ = keys.rotate(key.actor, key.id, timedelta(hours=1))
    assert room.people.key_of(secret) is not None
    last, _ = keys.rotate(key.actor, newer.id, timedelta(0))
    assert {one.id for one in keys.all_of(key.actor)} == {key.id, newer.id, last.id}
    with pytest.raises(StateConflict):
        keys.rotate(key.actor, newer.id, timedelta(0))


def test_another_tenants_key_is_not_there(room: Room, keys: Keys) -> None:
    mine, _ = room.people.create_key("clinic", ["keys:manage"])
    other, _ = room.people.create_key("other", ["keys:manage"])
    with pytest.raises(KeyNotFound):
        keys.revoke(other.actor, mine.id)
    assert [one.id for one in keys.all_of(other.actor)] == [other.id]


def test_a_portal_has_no_more_living_keys_than_anybody_needs(
    room: Room, keys: Keys, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keys_module, "KEYS_AT_MOST", 2)
    first, _ = room.people.create_key("clinic", ["keys:manage"])
    second, _ = keys.create(first.actor, "second", ["keys:manage"])
    with pytest.raises(StateConflict):
        keys.create(first.actor, "third", ["keys:manage"])
    keys.revoke(first.actor, second.id)
    keys.create(first.actor, "third", ["keys:manage"])


def test_pages_neither_skip_nor_repeat_cases_opened_at_the_same_moment(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    actor, listing = room.portal(), CaseList(room.database)
    moment = keys_module.now()
    monkeypatch.setattr("lubdub.cases.store.now", lambda: moment)
    opened = {room.store.create(actor, girl_of_six())[0].id for _ in range(5)}
    room.store.create(room.portal("other"), girl_of_six())
    seen: list[str] = []
    cursor: str | None = None
    while True:
        page = listing.page(actor, Wanted(2, cursor))
        seen += [case.id for case in page.cases]
        cursor = page.next_cursor
        if cursor is None:
            break
    assert len(seen) == 5
    assert set(seen) == opened
