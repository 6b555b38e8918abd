"""The vault of sealed files, and the master key it stands on."""

from __future__ import annotations

import os

import pytest

from lubdub.cases.errors import CaseNotFound, FileNotFound, SealBroken
from lubdub.cases.sealing import FRAME
from tests.cases.conftest import Room, girl_of_six

pytestmark = pytest.mark.parametrize("room", ["sqlite"], indirect=True)


def case_of(room: Room) -> str:
    return room.store.create(room.family(), girl_of_six())[0].id


def stored(room: Room) -> list[bytes]:
    return [path.read_bytes() for path in (room.folder / "files").rglob("*") if path.is_file()]


def test_a_large_file_written_in_pieces_comes_back_and_is_not_stored_plain(room: Room) -> None:
    case, piece = case_of(room), os.urandom(700_000)
    writer = room.vault.writer(case, "scan")
    for _ in range(12):
        writer.write(piece)
    sealed = writer.finish()
    assert (writer.size, sealed.size) == (8_400_000, 8_400_000)
    actor = room.family()
    with pytest.raises(CaseNotFound):
        room.store.receive_scan(actor, case, sealed, None)
    room.vault.put(case, "scan", piece * 12)
    assert room.vault.read(case, "scan") == piece * 12
    assert all(piece[:64] not in body for body in stored(room))


def test_a_file_written_again_uses_another_key(room: Room) -> None:
    case, data = case_of(room), bytes(FRAME)
    room.vault.put(case, "scan", data)
    (first,) = stored(room)
    room.vault.put(case, "scan", data)
    (second,) = stored(room)
    assert first[:64] != second[:64]


def test_an_aborted_upload_leaves_nothing(room: Room) -> None:
    case = case_of(room)
    writer = room.vault.writer(case, "scan")
    writer.write(bytes(7 << 20))
    writer.abort()
    assert stored(room) == []
    with pytest.raises(FileNotFound):
        room.vault.read(case, "scan")


def test_a_stored_file_that_was_touched_or_taken_away_does_not_open(room: Room) -> None:
    case = case_of(room)
    room.vault.put(case, "scan", b"skin")
    (path,) = [path for path in (room.folder / "files").rglob("*") if path.is_file()]
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(SealBroken):
        room.vault.read(case, "scan")
    path.unlink()
    with pytest.raises(SealBroken):
        room.vault.read(case, "scan")


def test_the_probe_leaves_nothing_behind(room: Room) -> None:
    room.vault.probe()
    assert stored(room) == []
