"""A service out of a backup and the newest keyring; cases deleted since then stay deleted, with their receipts."""

from __future__ import annotations

import hashlib
import hmac
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import obstore
import sqlalchemy as sa
from obstore.store import ObjectStore

from lubdub.cases import audit
from lubdub.cases.backup import BODIES, FORMAT, MANIFEST, OBJECTS, ROWS
from lubdub.cases.backup_rows import Row, decoded, opened_rows, reflected
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import SealBroken
from lubdub.cases.key_chain import NOTES, KeyChain, unwrapped
from lubdub.cases.keyring import Keyring, opened_backup
from lubdub.cases.master_key import MasterKeySource, NamesMasterKey, load
from lubdub.cases.object_store import open_store
from lubdub.cases.sealing import manifest_mac, open_frames
from lubdub.cases.values import SYSTEM

NAME_HEX = 16


class CannotRestore(Exception):
    """The text is one sentence for the person who runs the service."""


@dataclass(frozen=True)
class Restored:
    """What came back. deleted: cases of the backup that were deleted since, and stay so."""

    cases: int
    deleted: int
    files: int
    bodies: int


@dataclass(frozen=True)
class Target:
    """Where to: an empty database, an empty store, and no folder of reference bodies yet, or None for none."""

    database_url: str
    store_url: str
    references: Path | None


class Restore:
    """One backup, checked against its list of contents."""

    def __init__(self, folder: Path, keyring: Path, master_key: NamesMasterKey | Path) -> None:
        """Open it. Raises CannotRestore, KeyringUnusable, MasterKeyUnusable."""
        self._folder = folder
        self._contents, body, mac = _read_manifest(folder)
        self._ring = Keyring.read(keyring)
        self._master_key = master_key
        self._masters = load(MasterKeySource.of(master_key), may_make=False)
        self._key = opened_backup(self._ring, self._masters, self._contents["id"])
        if not hmac.compare_digest(manifest_mac(self._key, body.encode()), mac):
            raise CannotRestore("The backup's list of contents was changed. Use another backup.")

    def check(self) -> None:
        """Every file against its hash. Raises CannotRestore, naming the first that does not fit."""
        hashes = {ROWS: self._contents["rows_sha256"]}
        hashes |= {f"{OBJECTS}/{place}": sha256 for place, sha256 in self._contents["objects"].items()}
        hashes |= {f"{BODIES}/{one['file']}": one["sha256"] for one in self._contents["references"] if one["file"]}
        for name, expected in hashes.items():
            try:
                with (self._folder / name).open("rb") as file:
                    found = hashlib.file_digest(file, "sha256").hexdigest()
            except OSError:
                found = ""
            if found != expected:
                raise CannotRestore(f"The backup is damaged: {name} is missing or was changed. Use another backup.")

    def into(self, target: Target) -> Restored:
        """Bring everything back. The database comes last, so that a restore broken off can simply be made again.

        Raises CannotRestore for a place that is not empty, DatabaseTooNew for a backup of a newer version.
        """
        self.check()
        parsed = sa.make_url(target.database_url)
        if parsed.get_backend_name() != "sqlite":
            return self._fill(target, Database(target.database_url, self._contents["revision"]))
        final = Path(parsed.database or "")
        if final.exists():
            raise CannotRestore(f"There is a database already: {final.name}. Restore into an empty data folder.")
        draft = final.with_name(f"{final.name}.unfinished")
        for left in draft.parent.glob(f"{draft.name}*"):
            left.unlink()
        restored = self._fill(target, Database(f"sqlite:///{draft}", self._contents["revision"]))
        os.replace(draft, final)
        return restored

    def _fill(self, target: Target, database: Database) -> Restored:
        try:
            _must_be_empty(database)
            files = self._put_objects(open_store(target.store_url))
            bodies = self._put_bodies(target.references)
            cases, deleted = self._put_rows(database)
            KeyChain(database, self._master_key)  # the key opens what is there now, or this says that it does not
            with database.writing() as session:
                for case_id in sorted(deleted):
                    audit.append(database, session, SYSTEM, "case.deleted_since_backup", case_id, now())
                audit.append(database, session, SYSTEM, "service.restore", None, now(), self._contents["id"])
            database.forget_traces()
        finally:
            database.close()
        return Restored(len(cases), len(deleted), files, bodies)

    def _put_rows(self, database: Database) -> tuple[set[str], set[str]]:
        """All rows in one transaction, then the tables up to date; the living cases, and those deleted since."""
        alive: set[str] = set()
        deleted: set[str] = set()
        with database.engine.execution_options(lubdub_writes=True).begin() as connection:
            tables = reflected(connection).tables
            connection.execute(sa.delete(tables["tenants"]))  # the migrations put one there
            for line in self._lines():
                if "table" in line:
                    connection.execute(sa.insert(tables[line["table"]]).values(decoded(line["row"])))
                elif line["case"] in self._ring.cases:
                    wrapped = self._ring.cases[line["case"]]
                    rows = opened_rows(line, unwrapped(self._masters, wrapped, line["case"]))
                    for name, row in rows:
                        connection.execute(sa.insert(tables[name]).values(row))
                    key = {"case_id": line["case"], "wrapped_key": wrapped, "created_at": rows[0][1]["created_at"]}
                    connection.execute(sa.insert(tables["case_keys"]).values(key))
                    alive.add(line["case"])
                else:
                    connection.execute(
                        sa.insert(tables["cases"]).values(self._tombstone(tables["cases"], line["case"]))
                    )
                    deleted.add(line["case"])
            service = {"name": NOTES, "wrapped_key": self._ring.notes}
            connection.execute(sa.insert(tables["service_keys"]).values(service))
        database.upgrade()
        return alive, deleted

    def _lines(self) -> Iterator[dict[str, Any]]:
        """The backup's lines. Raises CannotRestore when they do not open."""
        with (self._folder / ROWS).open("rb") as file:
            name = file.read(NAME_HEX).decode("ascii", "replace")
            pieces: Callable[[], bytes] = lambda: file.read(1 << 20)  # noqa: E731
            waiting = b""
            try:
                for frame in open_frames(iter(pieces, b""), self._key, name, self._contents["id"], ROWS):
                    *whole, waiting = (waiting + frame).split(b"\n")
                    yield from map(json.loads, whole)
            except SealBroken as error:
                raise CannotRestore("The backup is damaged: its rows do not open. Use another backup.") from error

    def _tombstone(self, table: sa.Table, case_id: str) -> Row:
        """A case of the backup that was deleted since: its id and its receipt, nothing about the person."""
        if case_id not in self._ring.deletions:
            raise CannotRestore("This keyring is older than the backup: use the newest one.")
        receipt = self._ring.deletions[case_id]
        times = {name: _naive(receipt[name]) for name in ("created_at", "deleted_at")}
        empty: Row = {column.name: _nothing(column) for column in table.columns if not column.nullable}
        said = {"id": case_id, "tenant_id": receipt["tenant_id"], "receipt_sha256": receipt["receipt_sha256"]}
        return empty | said | times | {"status": "deleted", "updated_at": times["deleted_at"]}

    def _put_objects(self, store: ObjectStore) -> int:
        """The files of living cases, as they are. What an earlier try of this restore left in the store may stay."""
        known = self._contents["objects"]
        if any(found["path"] not in known for page in obstore.list(store) for found in page):
            raise CannotRestore("The store of files is not empty. Restore into an empty one.")
        wanted = [place for place in known if place.split("/")[0] in self._ring.cases]
        for place in wanted:
            obstore.put(store, place, self._folder / OBJECTS / place)
        return len(wanted)

    def _put_bodies(self, references: Path | None) -> int:
        kept = [one for one in self._contents["references"] if one["file"] and self._is_living(one["case"])]
        if not kept:
            return 0
        if references is None:
            raise CannotRestore("The backup holds reference bodies: name a new folder for them, LUBDUB_REFERENCES_DIR.")
        names = {one["name"] for one in kept}
        if any(path.is_file() and str(path.relative_to(references)) not in names for path in references.rglob("*")):
            raise CannotRestore("The folder of reference bodies is not empty. Name a new one, LUBDUB_REFERENCES_DIR.")
        for one in kept:
            path = references / one["name"]
            if not path.resolve().is_relative_to(references.resolve()):
                raise CannotRestore("The backup is damaged: a reference body has no name. Use another backup.")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(self._body(one))
        return len(kept)

    def _is_living(self, case: str | None) -> bool:
        return case is None or case in self._ring.cases

    def _body(self, one: dict[str, Any]) -> bytes:
        key = self._key
        if one["case"] is not None:
            key = unwrapped(self._masters, self._ring.cases[one["case"]], one["case"])
        sealed = (self._folder / BODIES / one["file"]).read_bytes()
        salt, rest = sealed[: 2 * NAME_HEX].decode(), sealed[2 * NAME_HEX :]
        return b"".join(open_frames([rest], key, salt, self._contents["id"], one["name"]))


def _read_manifest(folder: Path) -> tuple[dict[str, Any], str, str]:
    try:
        whole = json.loads((folder / MANIFEST).read_bytes())
        body, mac = str(whole["contents"]), str(whole["mac"])
        contents = json.loads(body)
        is_known = contents["format"] == FORMAT
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CannotRestore(
            f"{folder} is no backup, or one that was broken off: it has no list of contents."
        ) from error
    if not is_known:
        raise CannotRestore(f"{folder.name} was made by another version of Lubdub. Restore it with that one.")
    return contents, body, mac


def _must_be_empty(database: Database) -> None:
    with database.engine.connect() as connection:
        tables = reflected(connection).tables
        held = [name for name in ("cases", "audit") if connection.scalar(sa.select(tables[name]).limit(1)) is not None]
        if held or "dbos" in sa.inspect(connection).get_schema_names():
            raise CannotRestore("The database is not empty. Restore into an empty one.")


def _nothing(column: sa.Column[Any]) -> Any:
    """A value for a column that must have one."""
    if isinstance(column.type, sa.JSON):
        return {}
    kind = column.type.python_type
    return now().replace(tzinfo=None) if kind is datetime else kind()


def _naive(moment: str) -> datetime:
    return datetime.fromisoformat(moment).astimezone(UTC).replace(tzinfo=None)
