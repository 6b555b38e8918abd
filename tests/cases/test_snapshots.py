"""How cases stand, for processes that show them live and did not change them themselves."""

from __future__ import annotations

import pytest

from lubdub.cases.links import Links
from lubdub.cases.snapshots import Snapshots
from tests.cases.conftest import Room, girl_of_six


def test_a_changed_artefact_gets_another_version_and_an_unchanged_one_keeps_it(room: Room) -> None:
    case = room.store.create(room.family(), girl_of_six())[0]
    snapshots = Snapshots(room.database)
    before = snapshots.one(case.id)
    room.vault.put(case.id, "marks.json", b"{}")
    once = snapshots.one(case.id)
    room.vault.put(case.id, "marks.json", b"{}")
    twice = snapshots.one(case.id)
    assert before is not None
    assert once is not None
    assert twice is not None
    versions = {snapshot.version("marks.json") for snapshot in (before, once, twice)}
    assert len(versions) == 3
    assert before.version("scan") == twice.version("scan")


def test_a_version_does_not_say_where_the_object_lies(room: Room) -> None:
    case = room.store.create(room.family(), girl_of_six())[0]
    room.vault.put(case.id, "marks.json", b"{}")
    snapshot = Snapshots(room.database).one(case.id)
    assert snapshot is not None
    assert snapshot.version("marks.json") not in snapshot.files["marks.json"]


def test_a_case_that_is_deleted_stands_nowhere(room: Room) -> None:
    family = room.family()
    kept, gone = (room.store.create(family, girl_of_six())[0].id for _ in range(2))
    room.privacy.delete(family, gone)
    assert set(Snapshots(room.database).of([kept, gone])) == {kept}


def test_a_case_that_was_handed_over_says_whose_it_is_now(room: Room) -> None:
    first, second = room.family(), room.family()
    case = room.store.create(first, girl_of_six())[0].id
    links = Links(room.database)
    links.take(second, links.offer(first, case).code)
    snapshot = Snapshots(room.database).one(case)
    assert snapshot is not None
    assert snapshot.owner == second.id


@pytest.mark.parametrize("count", [0, 3])
def test_cases_are_looked_up_together(room: Room, count: int) -> None:
    family = room.family()
    ids = [room.store.create(family, girl_of_six())[0].id for _ in range(count)]
    assert set(Snapshots(room.database).of(ids)) == set(ids)
