"""The master key from a file, from the environment and from a key service; and what stands in its way, in words."""

from __future__ import annotations

import base64
import stat
import sys
from pathlib import Path

import pytest

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.master_key import MasterKeySource, MasterKeyUnusable, load
from tests.cases.conftest import Room, girl_of_six

SERVICE = """
import base64, sys
turned = bytes(byte ^ 0x5a for byte in base64.b64decode(sys.stdin.read()))
{more}
print(base64.b64encode(turned).decode())
"""
"""A stand-in for a key service's command: what it wraps can only be read through it."""


def text(key: bytes) -> str:
    return base64.b64encode(key).decode()


def key_service(folder: Path, more: str = "") -> str:
    program = folder / "service.py"
    program.write_text(SERVICE.format(more=more))
    return f"{sys.executable} {program}"


def open_vault(room: Room, source: MasterKeySource) -> FileVault:
    return FileVault(room.database, (room.folder / "files").as_uri(), source)


def case_with_scan(room: Room, vault: FileVault) -> str:
    case, _ = room.store.create(room.family(), girl_of_six())
    vault.put(case.id, "scan", b"skin")
    return case.id


def test_the_master_key_is_made_once_for_its_owner_alone(tmp_path: Path) -> None:
    source = MasterKeySource(tmp_path / "keys" / "master.key")
    (key,) = load(source, may_make=True)
    assert len(key) == 32
    assert load(source, may_make=True) == (key,)
    assert stat.S_IMODE(source.file.stat().st_mode) == 0o600
    assert [found.name for found in source.file.parent.iterdir()] == ["master.key"]


def test_a_file_that_holds_the_bare_bytes_of_a_key_is_still_read(tmp_path: Path) -> None:
    source = MasterKeySource(tmp_path / "master.key")
    source.file.write_bytes(b"k" * 32)
    source.file.chmod(0o600)
    assert load(source, may_make=False) == (b"k" * 32,)


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        pytest.param(b"k" * 32, 0o640, "can be read by others", id="too open"),
        pytest.param(b"short", 0o600, "is damaged", id="short"),
        pytest.param(b"", 0o600, "is damaged", id="empty"),
        pytest.param(b"plain nonsense!\n", 0o600, "is damaged", id="not base64"),
        pytest.param(b"plain c2hvcnQ=\n", 0o600, "is damaged", id="short base64"),
        pytest.param(b"wrapped c2hvcnQ=\n", 0o600, "LUBDUB_MASTER_KEY_COMMAND", id="wrapped, no command"),
        pytest.param(None, 0o600, "is missing", id="missing"),
    ],
)
def test_a_key_file_that_cannot_be_used_is_said_in_one_sentence(
    tmp_path: Path, content: bytes | None, mode: int, words: str
) -> None:
    path = tmp_path / "master.key"
    if content is not None:
        path.write_bytes(content)
        path.chmod(mode)
    with pytest.raises(MasterKeyUnusable, match=rf"^The master key master\.key .*{words}") as said:
        load(MasterKeySource(path), may_make=False)
    assert "\n" not in str(said.value)


def test_the_key_may_come_from_the_environment_and_nothing_of_it_is_written(room: Room) -> None:
    folder = room.folder / "elsewhere"
    folder.mkdir()
    database = Database(f"sqlite:///{folder / 'cases.sqlite'}")
    source = MasterKeySource(folder / "master.key", text=text(b"e" * 32))
    FileVault(database, (folder / "files").as_uri(), source).check_key()
    database.close()
    assert not source.file.exists()
    assert all(b"e" * 32 not in path.read_bytes() for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("word", ["", "nonsense", "c2hvcnQ=", ","])
def test_a_key_in_the_environment_that_is_none_is_said_without_showing_it(tmp_path: Path, word: str) -> None:
    source = MasterKeySource(tmp_path / "master.key", text=f"{text(b'e' * 32)},{word}")
    with pytest.raises(MasterKeyUnusable, match=r"^The key in LUBDUB_MASTER_KEY is damaged") as said:
        load(source, may_make=False)
    assert text(b"e" * 32) not in str(said.value)


def test_a_key_service_wraps_what_the_file_holds_and_opens_it_again(tmp_path: Path) -> None:
    source = MasterKeySource(tmp_path / "master.key", command=key_service(tmp_path))
    (key,) = load(source, may_make=True)
    assert load(source, may_make=False) == (key,)
    assert source.file.read_text().startswith("wrapped ")
    assert text(key) not in source.file.read_text()
    with pytest.raises(MasterKeyUnusable, match="LUBDUB_MASTER_KEY_COMMAND"):
        load(MasterKeySource(source.file), may_make=False)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        pytest.param("sys.exit('secret words')", "ended with code 1", id="fails"),
        pytest.param("turned = b''", "did not answer in base64", id="says nothing"),
        pytest.param("turned = b'short'", "is damaged", id="gives another key"),
    ],
)
def test_a_key_service_that_fails_is_said_without_its_own_words(tmp_path: Path, more: str, words: str) -> None:
    load(MasterKeySource(tmp_path / "master.key", command=key_service(tmp_path)), may_make=True)
    with pytest.raises(MasterKeyUnusable, match=words) as said:
        load(MasterKeySource(tmp_path / "master.key", command=key_service(tmp_path, more)), may_make=False)
    assert "secret words" not in str(said.value)


def test_a_key_service_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(MasterKeyUnusable, match="cannot be run when asked to wrap"):
        load(MasterKeySource(tmp_path / "master.key", command="/nowhere/kms"), may_make=True)


@pytest.mark.parametrize("room", ["sqlite"], indirect=True)
class TestAgainstWhatIsStored:
    def test_a_wrong_key_is_refused_before_anything_is_sealed_under_it(self, room: Room) -> None:
        case_with_scan(room, room.vault)
        other = room.folder / "other.key"
        load(MasterKeySource(other), may_make=True)
        with pytest.raises(MasterKeyUnusable, match=r"other\.key is not the one that sealed what is stored here"):
            open_vault(room, MasterKeySource(other))

    def test_a_missing_key_is_never_replaced_by_a_new_one(self, room: Room) -> None:
        case_with_scan(room, room.vault)
        path = room.folder / "master.key"
        path.rename(room.folder / "safe.key")
        with pytest.raises(MasterKeyUnusable, match="Put it back from where you keep its copy"):
            open_vault(room, MasterKeySource(path))
        assert not path.exists()

    def test_a_key_exchanged_while_the_service_runs_is_noticed_and_never_used(self, room: Room) -> None:
        case = case_with_scan(room, room.vault)
        other = room.folder / "other.key"
        load(MasterKeySource(other), may_make=True)
        (room.folder / "master.key").rename(room.folder / "safe.key")
        other.rename(room.folder / "master.key")
        with pytest.raises(MasterKeyUnusable, match="was exchanged"):
            room.vault.check_key()
        later = case_with_scan(room, room.vault)
        (room.folder / "safe.key").rename(room.folder / "master.key")
        room.vault.check_key()
        fresh = open_vault(room, MasterKeySource(room.folder / "master.key"))
        assert [fresh.read(one, "scan") for one in (case, later)] == [b"skin", b"skin"]
