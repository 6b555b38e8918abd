"""Several processes change one small artefact: no change is lost."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor

import pytest

from lubdub.cases.errors import FileNotFound, StateConflict
from lubdub.cases.revising import revise
from tests.cases.conftest import Room, girl_of_six


def adding(name: str):  # type: ignore[no-untyped-def]
    return lambda stored: json.dumps([*(json.loads(stored) if stored else []), name]).encode()


def test_changes_made_at_the_same_moment_all_stay(room: Room) -> None:
    case = room.store.create(room.family(), girl_of_six())[0].id
    names = [f"name {number}" for number in range(12)]
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(lambda name: revise(room.database, room.vault, case, "marks.json", adding(name)), names))
    assert sorted(json.loads(room.vault.read(case, "marks.json"))) == sorted(names)


def test_what_was_replaced_leaves_no_object_behind(room: Room) -> None:
    case = room.store.create(room.family(), girl_of_six())[0].id
    for name in ("one", "two", "three"):
        revise(room.database, room.vault, case, "marks.json", adding(name))
    assert len(list((room.folder / "files" / case).iterdir())) == 1


def test_a_change_that_came_in_between_is_seen_by_the_second_try(room: Room) -> None:
    case = room.store.create(room.family(), girl_of_six())[0].id
    seen: list[bytes | None] = []

    def slow(stored: bytes | None) -> bytes:
        seen.append(stored)
        if len(seen) == 1:
            room.vault.put(case, "marks.json", b"theirs")
        return (stored or b"") + b" and ours"

    assert revise(room.database, room.vault, case, "marks.json", slow) == b"theirs and ours"
    assert seen == [None, b"theirs"]


def test_it_is_said_when_others_never_stop_changing_it(room: Room) -> None:
    case = room.store.create(room.family(), girl_of_six())[0].id

    def always_late(stored: bytes | None) -> bytes:
        room.vault.put(case, "marks.json", b"theirs")
        return b"ours"

    with pytest.raises(StateConflict):
        revise(room.database, room.vault, case, "marks.json", always_late)
    assert room.vault.read(case, "marks.json") == b"theirs"


def test_nothing_is_stored_for_a_case_that_is_deleted(room: Room) -> None:
    family = room.family()
    case = room.store.create(family, girl_of_six())[0].id
    room.privacy.delete(family, case)
    with pytest.raises(FileNotFound):
        revise(room.database, room.vault, case, "marks.json", lambda stored: b"{}")
