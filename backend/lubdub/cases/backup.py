"""A backup while the service runs: all rows as of one moment, and every sealed file they point at, as it is.

It is written beside its place and moved there when it is whole. Nothing in it is plain, and no key is in it: those of
the cases are in the keyring, and the master key is nobody's business but its keeper's.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lubdub.cases import audit
from lubdub.cases.backup_rows import lines
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.cases.keyring import renewed
from lubdub.cases.sealing import KEY_BYTES, FrameSealer, manifest_mac
from lubdub.cases.values import SYSTEM

FORMAT = 1
MANIFEST, ROWS, OBJECTS, BODIES = "manifest.json", "rows.sealed", "objects", "references"
ROUNDS = 20
"""Cases change while their files are copied; then the rows are read again, and only what is new is copied."""


class CannotBackUp(Exception):
    """The text is one sentence for the person who runs the service."""


@dataclass(frozen=True)
class OwnFile:
    """A file of a reference body of one's own. name: its path in the folder of references; case: whose body it is."""

    name: str
    path: Path
    case: str | None


@dataclass(frozen=True)
class Made:
    """What a backup holds. missing: files that cases point at and the store does not have."""

    folder: Path
    keyring: Path
    cases: int
    files: int
    missing: tuple[str, ...]


class Backup:
    """Makes backups of a running service."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over open services."""
        self._database = database
        self._vault = vault

    def make(self, folder: Path, keyring: Path, bodies: Sequence[OwnFile] = ()) -> Made:
        """Write a backup into a new folder, and the keyring anew. Raises CannotBackUp, KeyringUnusable, OSError."""
        if folder.exists():
            raise CannotBackUp(f"{folder} is there already: every backup gets a folder of its own.")
        if keyring.resolve().is_relative_to(folder.resolve()):
            raise CannotBackUp("The keyring must not lie in the backup: whoever kept both would keep deleted cases.")
        folder.parent.mkdir(parents=True, exist_ok=True)
        renewed(self._database, self._vault.keys, keyring)  # a keyring that does not fit is refused before any work
        draft = folder.with_name(f"{folder.name}.unfinished")
        if draft.exists():
            shutil.rmtree(draft)
        draft.mkdir(mode=0o700)
        key, backup_id = secrets.token_bytes(KEY_BYTES), secrets.token_hex(8)
        content = _Content(draft, backup_id, key)
        said = self._fill(content)
        said["references"] = [content.keep_body(number, body, self._vault) for number, body in enumerate(bodies)]
        content.finish(said)
        # Read again: a case deleted while its files were copied is not to be in the keyring.
        ring = renewed(self._database, self._vault.keys, keyring)
        ring = replace(ring, backups={**ring.backups, backup_id: self._vault.keys.wrap(key, backup_id)})
        ring.write(keyring)
        os.replace(draft, folder)
        _flush_folder(folder.parent)
        with self._database.writing() as session:
            audit.append(self._database, session, SYSTEM, "service.backup", None, now(), backup_id)
        return Made(folder, keyring, said["cases"], len(said["objects"]), tuple(said["missing"]))

    def _fill(self, content: _Content) -> dict[str, Any]:
        """Rows and objects that belong together, and what the list of contents says about them."""
        copied: dict[str, str] = {}
        missing: set[str] = set()
        for _ in range(ROUNDS):
            with self._database.snapshot() as connection:
                revision = self._database.revision(connection)
                pointed = content.write_rows(lines(connection, self._vault.keys.case_key))
            before, missing = missing, set()
            for place in sorted(pointed.objects - copied.keys()):
                found = content.copy(place, self._vault.sealed_bytes(place))
                if found is None:
                    missing.add(place)
                else:
                    copied[place] = found
            if missing <= before:  # none, or the same as a moment ago: these are truly gone
                break
        else:
            raise CannotBackUp("Cases change faster than they can be copied here. Try again at a quieter time.")
        for place in copied.keys() - pointed.objects:
            (content.folder / OBJECTS / place).unlink()
        return {
            "revision": revision,
            "cases": pointed.cases,
            "rows_sha256": pointed.sha256,
            "objects": {place: copied[place] for place in sorted(pointed.objects & copied.keys())},
            "missing": sorted(missing),
        }


@dataclass(frozen=True)
class _Pointed:
    """What the rows hold: how many living cases, and which objects."""

    cases: int
    objects: set[str]
    sha256: str


class _Content:
    """The folder of a backup while it is filled."""

    def __init__(self, folder: Path, backup_id: str, key: bytes) -> None:
        self.folder = folder
        self._id = backup_id
        self._key = key

    def write_rows(self, told: Iterator[tuple[dict[str, Any], list[tuple[str, str]]]]) -> _Pointed:
        """All rows, sealed under the backup's key, over those of an earlier round."""
        # Rows of several rounds must not meet one key twice under one counter, hence the name of each.
        name = secrets.token_hex(8)
        sealer = FrameSealer(self._key, name, self._id, ROWS)
        cases, digest = 0, hashlib.sha256()
        objects: set[str] = set()

        def blocks() -> Iterator[bytes]:
            nonlocal cases
            yield name.encode()
            for line, pointed in told:
                cases += "case" in line
                objects.update(f"{case_id}/{object_key}" for case_id, object_key in pointed)
                yield sealer.add(json.dumps(line).encode() + b"\n")
            yield sealer.last()

        _write(self.folder / ROWS, blocks(), digest)
        return _Pointed(cases, objects, digest.hexdigest())

    def copy(self, place: str, pieces: Iterator[bytes] | None) -> str | None:
        """Copy a sealed object as it is; its hash, or None when it is not there."""
        if pieces is None:
            return None
        path, digest = self.folder / OBJECTS / place, hashlib.sha256()
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(path, pieces, digest)
        return digest.hexdigest()

    def keep_body(self, number: int, body: OwnFile, vault: FileVault) -> dict[str, Any]:
        """A file of a reference body, under the key of the case it was made of; it goes where the case goes."""
        name = f"{number}.sealed"
        try:
            key = self._key if body.case is None else vault.keys.case_key(body.case)
        except FileNotFound:
            return {"name": body.name, "file": None, "case": body.case}
        salt, digest = secrets.token_hex(16), hashlib.sha256()
        sealer = FrameSealer(key, salt, self._id, body.name)
        (self.folder / BODIES).mkdir(exist_ok=True)
        pieces = iter((salt.encode(), sealer.add(body.path.read_bytes()), sealer.last()))
        _write(self.folder / BODIES / name, pieces, digest)
        return {"name": body.name, "file": name, "case": body.case, "sha256": digest.hexdigest()}

    def finish(self, said: dict[str, Any]) -> None:
        """The list of contents, last; with it the backup is whole."""
        said = {"format": FORMAT, "id": self._id, "made_at": now().isoformat()} | said
        body = json.dumps(said, sort_keys=True)
        whole = json.dumps({"contents": body, "mac": manifest_mac(self._key, body.encode())})
        _write(self.folder / MANIFEST, iter((whole.encode(),)), hashlib.sha256())
        for place in (self.folder / OBJECTS, self.folder):
            if place.is_dir():
                _flush_folder(place)


def _write(path: Path, pieces: Iterator[bytes], digest: Any) -> None:
    with path.open("wb") as file:
        for piece in pieces:
            file.write(piece)
            digest.update(piece)
        file.flush()
        os.fsync(file.fileno())


def _flush_folder(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
