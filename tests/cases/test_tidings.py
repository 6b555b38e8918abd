"""How far the stories of many cases have come, in one look."""

from __future__ import annotations

from lubdub.cases.tidings import Standing, Tidings
from tests.cases.conftest import Room, girl_of_six


def test_one_look_tells_of_many_cases_whose_they_are_and_how_far_they_have_come(room: Room) -> None:
    portal, family = room.portal(), room.family()
    first, _ = room.store.create(portal, girl_of_six())
    second, _ = room.store.create(family, girl_of_six())
    room.store.receive_scan(family, second.id, room.vault.seal(second.id, "scan", b"skin"), None)
    found = Tidings(room.database).of([first.id, second.id, "nobody"])
    assert found == {first.id: Standing(None, 1), second.id: Standing(family.id, 2)}


def test_a_deleted_case_is_missing(room: Room) -> None:
    actor = room.portal()
    case, _ = room.store.create(actor, girl_of_six())
    room.privacy.delete(actor, case.id)
    assert Tidings(room.database).of([case.id]) == {}


def test_nobody_listening_costs_nothing(room: Room) -> None:
    room.database.close()
    assert Tidings(room.database).of([]) == {}
