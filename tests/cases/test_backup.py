"""Backup and restore: whole or not at all, while cases come and go; what is deleted stays deleted, in all backups."""

from __future__ import annotations

import json
import shutil
import threading
import time
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.backup import Backup, CannotBackUp, OwnFile
from lubdub.cases.database import Database
from lubdub.cases.errors import CaseNotFound, FileNotFound
from lubdub.cases.files import FileVault
from lubdub.cases.keyring import Keyring, KeyringUnusable
from lubdub.cases.master_key import MasterKeyUnusable
from lubdub.cases.models import CaseKeyRow, CaseRow, FileRow
from lubdub.cases.privacy import Privacy
from lubdub.cases.restoring import CannotRestore, Restore, Restored, Target
from lubdub.cases.rotation import Rotation
from lubdub.cases.store import Asked, CaseStore
from lubdub.cases.values import SYSTEM, Actor
from lubdub.cases.work import Handed, WorkDesk
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_rotation import let_it_settle
from tests.databases import fresh_database

MARKER = "patient-4711"
PLACE = 123456.789012


@dataclass(frozen=True)
class Restoration:
    """A service that came out of a backup."""

    done: Restored
    database: Database
    vault: FileVault
    store: CaseStore


def scanned(room: Room, actor: Actor, scan: bytes = b"skin") -> str:
    """A case whose scan was examined and whose run waits, with things about the person in every table there is."""
    case, _ = room.store.create(actor, girl_of_six(external_id=MARKER))
    _, job = room.store.receive_scan(actor, case.id, room.vault.seal(case.id, "scan", scan), None)
    room.desk.hand_in(job, Handed("awaiting_landmarks", {"examination.npz": b"npz", "scan.ply": scan}))
    room.store.place_landmarks(actor, case.id, Asked({"navel": [PLACE, 0.0, 0.0]}))
    return case.id


def back_up(room: Room, name: str = "one") -> Path:
    return Backup(room.database, room.vault).make(room.folder / "backups" / name, keyring(room)).folder


def keyring(room: Room) -> Path:
    return room.folder / "apart" / "lubdub.keyring"


def restore(room: Room, backup: Path, request: pytest.FixtureRequest, key: Path | None = None) -> Restoration:
    """Into an empty database of the same kind."""
    home = room.folder / f"restored-{backup.name}-{time.monotonic_ns()}"
    home.mkdir()
    opened = fresh_database("sqlite" if room.database.is_sqlite else "postgresql", home)
    url = opened.__enter__()
    request.addfinalizer(lambda: opened.__exit__(None, None, None))
    files = (home / "files").as_uri()
    master = room.folder / "master.key"
    done = Restore(backup, key or keyring(room), master).into(Target(url, files, home / "references"))
    database = Database(url)
    request.addfinalizer(database.close)
    vault = FileVault(database, files, master)
    return Restoration(done, database, vault, CaseStore(database, vault))


@pytest.fixture(autouse=True)
def apart(room: Room) -> None:
    keyring(room).parent.mkdir()


def test_what_was_backed_up_comes_back_as_it_was(room: Room, request: pytest.FixtureRequest) -> None:
    portal = room.portal()
    made = scanned(room, portal)
    gone = scanned(room, portal)
    receipt = room.privacy.delete(portal, gone)
    before = room.store.get(portal, made)
    found = restore(room, back_up(room), request)
    assert (found.done.cases, found.done.deleted, found.done.files) == (1, 0, 3)
    assert found.store.get(portal, made) == before
    assert found.vault.read(made, "scan") == b"skin"
    assert [job.id for job in WorkDesk(found.database, found.vault).waiting()] == [before.job_id]
    assert Privacy(found.database, found.vault).receipt(portal, gone) == receipt
    assert audit.first_broken_line(found.database) is None


def test_a_case_deleted_after_a_backup_stays_deleted_when_that_is_restored(
    room: Room, request: pytest.FixtureRequest
) -> None:
    portal = room.portal()
    kept, gone = scanned(room, portal), scanned(room, portal)
    old = back_up(room, "old")
    receipt = room.privacy.delete(portal, gone)
    back_up(room, "new")
    found = restore(room, old, request)
    assert (found.done.cases, found.done.deleted) == (1, 1)
    assert found.store.get(portal, kept).id == kept
    with pytest.raises(CaseNotFound):
        found.store.get(portal, gone)
    assert Privacy(found.database, found.vault).receipt(portal, gone) == receipt
    with pytest.raises(FileNotFound):
        found.vault.keys.case_key(gone)
    with found.database.reading() as session:
        row = session.get_one(CaseRow, gone)
        assert (row.external_id, row.landmarks, row.age_years, row.answers) == (None, None, None, {})
    assert not list((found.database.engine and room.folder).glob(f"restored-old-*/files/{gone}/*"))


def test_nothing_in_a_backup_is_plain_and_a_deleted_case_opens_with_no_key_that_is_left(room: Room) -> None:
    portal = room.portal()
    gone = scanned(room, portal, scan=b"the shape of a chest" * 50)
    backup = back_up(room, "old")
    everything = b"".join(path.read_bytes() for path in backup.rglob("*") if path.is_file())
    for plain in (MARKER.encode(), str(PLACE).encode(), b"the shape of a chest", *room.vault.keys.masters()):
        assert plain not in everything
    room.privacy.delete(portal, gone)
    back_up(room, "new")
    with pytest.raises(KeyError):
        Keyring.read(keyring(room)).cases[gone]
    old = Restore(backup, keyring(room), room.folder / "master.key")
    lines = [line for line in old._lines() if line.get("case") == gone]
    assert set(lines[0]) == {"case", "sealed"}, "the line is there, and its key is not"
    assert MARKER not in json.dumps(list(old._lines()))


def test_a_backup_made_while_cases_come_change_and_go_holds_whole_cases_alone(
    room: Room, request: pytest.FixtureRequest
) -> None:
    portal, stop = room.portal(), threading.Event()
    made = [scanned(room, portal) for _ in range(3)]

    def keep_busy() -> None:
        while not stop.is_set():
            case = scanned(room, portal)
            made.append(case)
            room.vault.put(case, "scan", b"another skin")
            if len(made) % 3 == 0:
                room.privacy.delete(portal, made[-3])

    busy = threading.Thread(target=keep_busy)
    busy.start()
    try:
        while len(made) < 6:
            time.sleep(0.01)
        backup = back_up(room)
    finally:
        stop.set()
        busy.join()
    found = restore(room, backup, request)
    assert found.done.cases >= 3
    with found.database.reading() as session:
        files = session.execute(sa.select(FileRow.case_id, FileRow.artefact)).all()
        keys = set(session.scalars(sa.select(CaseKeyRow.case_id)))
        living = set(session.scalars(sa.select(CaseRow.id).where(CaseRow.deleted_at.is_(None))))
    assert {case for case, _ in files} <= keys == living
    for case, artefact in files:
        assert found.vault.read(case, artefact) in (b"skin", b"another skin", b"npz")
    desk = WorkDesk(found.database, found.vault)
    for job in desk.waiting():
        assert desk.hand_in(job, Handed("done", {"result.json": b"{}"}))
    with found.database.reading() as session:
        assert set(session.scalars(sa.select(CaseRow.status).where(CaseRow.id.in_(living)))) <= {
            "done",
            "awaiting_scan",
            "awaiting_landmarks",
        }
    assert audit.first_broken_line(found.database) is None


def test_older_backups_open_after_a_rotation_with_the_newest_keyring(
    room: Room, request: pytest.FixtureRequest
) -> None:
    portal = room.portal()
    case = scanned(room, portal)
    old = back_up(room, "old")
    rotation = Rotation(room.database, room.vault.keys)
    rotation.begin()
    rotation.seal_anew()
    back_up(room, "new")
    let_it_settle(room)
    rotation.retire()
    assert restore(room, old, request).vault.read(case, "scan") == b"skin"


def test_a_reference_body_goes_where_its_case_goes(room: Room, request: pytest.FixtureRequest) -> None:
    portal = room.portal()
    kept, gone = scanned(room, portal), scanned(room, portal)
    body = room.folder / "body.npz"
    body.write_bytes(b"a body's shape")
    bodies = [OwnFile("bodies/a/body.npz", body, kept), OwnFile("bodies/b/body.npz", body, gone)]
    bodies.append(OwnFile("basis.npz", body, None))
    backup = Backup(room.database, room.vault).make(room.folder / "old", keyring(room), bodies).folder
    assert all(b"a body's shape" not in path.read_bytes() for path in backup.rglob("*") if path.is_file())
    room.privacy.delete(portal, gone)
    back_up(room, "new")
    found = restore(room, backup, request)
    assert found.done.bodies == 2
    (home,) = room.folder.glob("restored-old-*/references")
    assert sorted(str(path.relative_to(home)) for path in home.rglob("*.npz")) == ["basis.npz", "bodies/a/body.npz"]


@pytest.mark.parametrize("room", ["sqlite"], indirect=True)
class TestWhatIsInTheWay:
    def test_a_backup_broken_off_does_not_look_like_one(self, room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
        scanned(room, room.portal())
        monkeypatch.setattr(FileVault, "sealed_bytes", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left")))
        with pytest.raises(OSError, match="No space"):
            back_up(room)
        assert not (room.folder / "backups" / "one").exists()
        with pytest.raises(CannotRestore, match="is no backup, or one that was broken off"):
            Restore(room.folder / "backups" / "one.unfinished", keyring(room), room.folder / "master.key")
        monkeypatch.undo()
        assert back_up(room).is_dir()
        assert not (room.folder / "backups" / "one.unfinished").exists()

    @pytest.mark.parametrize("kind", ["object", "rows", "contents"])
    def test_a_backup_that_was_changed_is_refused_before_anything_is_written(self, room: Room, kind: str) -> None:
        scanned(room, room.portal())
        backup = back_up(room)
        patterns = {"object": "objects/*/*", "rows": "rows.sealed", "contents": "manifest.json"}
        path = next(backup.glob(patterns[kind]))
        content = path.read_bytes()
        changed = content.replace(b'\\"cases\\": 1', b'\\"cases\\": 2') if kind == "contents" else content[:-1] + b"x"
        assert changed != content
        path.write_bytes(changed)
        target = Target(f"sqlite:///{room.folder / 'new.sqlite'}", (room.folder / "new").as_uri(), None)
        with pytest.raises(CannotRestore, match=r"damaged|was changed"):
            Restore(backup, keyring(room), room.folder / "master.key").into(target)
        assert not (room.folder / "new.sqlite").exists()

    def test_nothing_that_is_there_is_written_over(self, room: Room) -> None:
        scanned(room, room.portal())
        backup = back_up(room)
        with pytest.raises(CannotBackUp, match="is there already"):
            back_up(room)
        again = Restore(backup, keyring(room), room.folder / "master.key")
        empty = Target(f"sqlite:///{room.folder / 'new.sqlite'}", (room.folder / "new").as_uri(), None)
        with pytest.raises(CannotRestore, match="There is a database already"):
            again.into(replace(empty, database_url=room.url))
        (room.folder / "new").mkdir()
        (room.folder / "new" / "strange").write_bytes(b"x")
        with pytest.raises(CannotRestore, match="store of files is not empty"):
            again.into(empty)
        (room.folder / "new" / "strange").unlink()
        assert again.into(empty).cases == 1, "and what the tries before left is no hindrance"

    def test_the_keyring_and_the_master_key_must_fit(self, room: Room) -> None:
        scanned(room, room.portal())
        shutil.copy(back_up(room, "old") / "manifest.json", room.folder)
        older = room.folder / "older.keyring"
        shutil.copy(keyring(room), older)
        backup, master = back_up(room, "new"), room.folder / "master.key"
        with pytest.raises(KeyringUnusable, match="older than the backup"):
            Restore(backup, older, master)
        with pytest.raises(KeyringUnusable, match="There is no keyring"):
            Restore(backup, room.folder / "nowhere", master)
        with pytest.raises(KeyringUnusable, match="no keyring, or it is damaged"):
            Restore(backup, room.folder / "manifest.json", master)
        with pytest.raises(MasterKeyUnusable, match="is missing"):
            Restore(backup, keyring(room), room.folder / "nowhere")
        foreign = room.folder / "foreign.key"
        foreign.write_bytes(b"f" * 32)
        foreign.chmod(0o600)
        with pytest.raises(KeyringUnusable, match="does not open this keyring"):
            Restore(backup, keyring(room), foreign)
        with pytest.raises(CannotBackUp, match="must not lie in the backup"):
            Backup(room.database, room.vault).make(room.folder / "third", room.folder / "third" / "keyring")

    def test_a_file_that_is_missing_in_the_store_is_told_and_the_rest_is_kept(self, room: Room) -> None:
        case = scanned(room, room.portal())
        (lost, *_) = sorted((room.folder / "files" / case).iterdir())
        lost.unlink()
        made = Backup(room.database, room.vault).make(room.folder / "backup", keyring(room))
        assert made.missing == (f"{case}/{lost.name}",)
        assert made.files == 2
        assert room.store.get(SYSTEM, case).id == case
