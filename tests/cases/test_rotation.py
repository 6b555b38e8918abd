"""A new master key while the service runs: nothing is lost, at whatever point it is broken off."""

from __future__ import annotations

import os
import threading
import time

import pytest
import sqlalchemy as sa

from lubdub.cases import rotation as rotation_module
from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.cases.master_key import MasterKeySource, load
from lubdub.cases.models import CaseKeyRow
from lubdub.cases.rotation import CannotRotate, Rotation
from lubdub.cases.store import CaseStore
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_master_key import key_service, text


def another_process(room: Room, source: MasterKeySource | None = None) -> FileVault:
    """The vault as another process of the service opens it."""
    return FileVault(room.database, (room.folder / "files").as_uri(), source or room.vault.keys.source)


def new_case(room: Room, vault: FileVault) -> str:
    case, _ = CaseStore(room.database, vault).create(room.family(), girl_of_six())
    vault.put(case.id, "scan", case.id.encode())
    return case.id


def let_it_settle(room: Room) -> None:
    old = time.time() - rotation_module.SETTLES_S - 1
    os.utime(room.folder / "master.key", (old, old))


def test_cases_from_before_during_and_after_a_rotation_open_in_every_process(room: Room) -> None:
    other = another_process(room)
    cases = [new_case(room, room.vault) for _ in range(3)]
    note = room.vault.sealed_note("somebody", b"note")
    (old,) = room.vault.keys.masters()
    rotation = Rotation(room.database, room.vault.keys)
    assert rotation.begin()
    cases.append(new_case(room, other))
    assert rotation.standing().behind == 4, "three cases and the key of notes; what another process makes now is not"
    assert rotation.seal_anew() == 4
    assert rotation.standing().behind == 0
    let_it_settle(room)
    assert rotation.retire() == 1
    assert old not in room.vault.keys.masters()
    cases.append(new_case(room, other))
    for vault in (room.vault, other, another_process(room)):
        assert [vault.read(case, "scan") for case in cases] == [case.encode() for case in cases]
        assert vault.unsealed_note("somebody", note) == b"note"


def test_a_rotation_broken_off_goes_on_where_it_was(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rotation_module, "AT_ONCE", 2)
    cases = [new_case(room, room.vault) for _ in range(5)]

    def break_off(done: int) -> None:
        if done > 1:
            raise KeyboardInterrupt

    rotation = Rotation(room.database, room.vault.keys)
    rotation.begin()
    with pytest.raises(KeyboardInterrupt):
        rotation.seal_anew(break_off)
    assert 0 < rotation.standing().behind < 6
    again = another_process(room)
    assert [again.read(case, "scan") for case in cases] == [case.encode() for case in cases]
    later = Rotation(room.database, again.keys)
    assert not later.begin(), "no third key is made"
    later.seal_anew()
    assert later.standing().behind == 0


def test_a_case_deleted_while_keys_are_sealed_anew_stays_deleted(room: Room) -> None:
    actor = room.family()
    case, _ = room.store.create(actor, girl_of_six())
    rotation = Rotation(room.database, room.vault.keys)
    rotation.begin()
    batches = list(rotation._batches())
    room.privacy.delete(actor, case.id)
    assert [rotation._seal_batch(batch) for batch in batches] == [1, 0]
    with pytest.raises(FileNotFound):
        room.vault.keys.case_key(case.id)


def test_nothing_is_lost_while_cases_come_in(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rotation_module, "AT_ONCE", 3)
    other, made, stop = another_process(room), [new_case(room, room.vault)], threading.Event()

    def keep_coming() -> None:
        while not stop.is_set():
            made.append(new_case(room, other))

    coming = threading.Thread(target=keep_coming)
    coming.start()
    try:
        rotation = Rotation(room.database, room.vault.keys)
        while len(made) < 8:
            time.sleep(0.01)
        rotation.begin()
        rotation.seal_anew()
    finally:
        stop.set()
        coming.join()
    let_it_settle(room)
    rotation.retire()
    last = another_process(room)
    assert len(last.keys.masters()) == 1
    assert [last.read(case, "scan") for case in made] == [case.encode() for case in made]


def test_the_old_key_is_kept_until_nothing_can_need_it(room: Room) -> None:
    new_case(room, room.vault)
    rotation = Rotation(room.database, room.vault.keys)
    with pytest.raises(CannotRotate, match="no old master key"):
        rotation.retire()
    rotation.begin()
    with pytest.raises(CannotRotate, match="too young: try again in"):
        rotation.retire()
    assert len(load(room.vault.keys.source, may_make=False)) == 2
    let_it_settle(room)
    rotation.retire()
    assert rotation.standing().behind == 0, "what was not sealed anew before is so before the old key goes"


@pytest.mark.parametrize("room", ["sqlite"], indirect=True)
def test_what_the_old_key_had_sealed_is_in_no_file_of_the_database_afterwards(room: Room) -> None:
    new_case(room, room.vault)
    with room.database.reading() as session:
        wrapped = session.scalars(sa.select(CaseKeyRow.wrapped_key)).one()
    rotation = Rotation(room.database, room.vault.keys)
    rotation.begin()
    rotation.seal_anew()
    assert all(wrapped not in path.read_bytes() for path in room.folder.glob("cases.sqlite*"))


@pytest.mark.parametrize("room", ["sqlite"], indirect=True)
def test_a_rotation_moves_an_installation_under_a_key_service(room: Room) -> None:
    case = new_case(room, room.vault)
    source = MasterKeySource(room.folder / "master.key", command=key_service(room.folder))
    moved = another_process(room, source)
    rotation = Rotation(room.database, moved.keys)
    rotation.begin()
    rotation.seal_anew()
    let_it_settle(room)
    rotation.retire()
    assert source.file.read_text().startswith("wrapped ")
    assert "plain" not in source.file.read_text()
    assert another_process(room, source).read(case, "scan") == case.encode()


@pytest.mark.parametrize("room", ["sqlite"], indirect=True)
def test_a_rotation_of_keys_in_the_environment_says_what_to_do(room: Room) -> None:
    case = new_case(room, room.vault)
    (old,) = room.vault.keys.masters()
    source = MasterKeySource(room.folder / "none", text=text(old))
    with pytest.raises(CannotRotate, match="put a new one and a comma before it"):
        Rotation(room.database, another_process(room, source).keys).begin()
    both = another_process(room, MasterKeySource(room.folder / "none", text=f"{text(b'n' * 32)},{text(old)}"))
    rotation = Rotation(room.database, both.keys)
    assert not rotation.begin()
    assert rotation.seal_anew() == 2
    with pytest.raises(CannotRotate, match="take them out of LUBDUB_MASTER_KEY"):
        rotation.retire()
    alone = another_process(room, MasterKeySource(room.folder / "none", text=text(b"n" * 32)))
    assert alone.read(case, "scan") == case.encode()
