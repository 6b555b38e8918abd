"""Sealed files of cases in a folder or an S3 bucket. Nothing plain ever reaches the store."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import obstore
import sqlalchemy as sa
from obstore.store import ObjectStore
from sqlalchemy.orm import Session

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import FileNotFound, SealBroken
from lubdub.cases.key_chain import KeyChain
from lubdub.cases.master_key import NamesMasterKey
from lubdub.cases.models import FileRow
from lubdub.cases.object_store import open_store
from lubdub.cases.sealing import FrameSealer, open_frames, signature, unwrap_key, wrap_key

Artefact = Literal[
    "scan",
    "examination.npz",
    "examination.json",
    "scan.ply",
    "outcome.npz",
    "result.json",
    "view.html",
    "view.es.html",
    "view.ja.html",
    "reviewed.html",
    "reviewed.es.html",
    "reviewed.ja.html",
    "marks.json",
    "part of scan",
]
PART = 5 << 20
"""Bytes held back by the writer: the smallest part an S3 upload may have."""


OF_SCAN: tuple[Artefact, ...] = ("scan",)
OF_CHECK: tuple[Artefact, ...] = ("examination.npz", "examination.json", "scan.ply", "marks.json")
"""What stays when landmarks are placed anew; `marks.json` holds the points as they are being placed."""


@dataclass(frozen=True)
class Sealed:
    """A file that is written but belongs to no artefact yet; `attach` makes it one."""

    object_key: str
    size: int


class FileVault:
    """Every file of every case, sealed. One artefact of a case is one object with a random name."""

    def __init__(self, database: Database, store_url: str, master_key: NamesMasterKey | Path) -> None:
        """Over an open database and store. Raises MasterKeyUnusable."""
        self._database = database
        self.keys = KeyChain(database, master_key)
        self._store: ObjectStore = open_store(store_url)

    def writer(self, case_id: str, artefact: Artefact) -> SealedWriter:
        """A new file for the case, to be written piece by piece. Raises FileNotFound when the case is deleted."""
        object_key = secrets.token_hex(16)
        sealer = FrameSealer(self.keys.case_key(case_id), object_key, case_id, artefact)
        return SealedWriter(self._store, case_id, object_key, sealer)

    def seal(self, case_id: str, artefact: Artefact, data: bytes) -> Sealed:
        """Write a whole file that is not attached yet."""
        writer = self.writer(case_id, artefact)
        try:
            writer.write(data)
            return writer.finish()
        except BaseException:
            writer.abort()
            raise

    def put(self, case_id: str, artefact: Artefact, data: bytes) -> None:
        """Write an artefact, over an older one if there is one."""
        sealed = self.seal(case_id, artefact, data)
        with self._database.writing() as session:
            replaced = attach(session, case_id, {artefact: sealed})
        self.discard(case_id, replaced)

    def derive(self, case_id: str, artefact: Artefact, source: Artefact, make: Callable[[bytes], bytes]) -> bytes:
        """Make an artefact out of another one and keep it, unless the other was replaced meanwhile.

        Raises FileNotFound when there is no source.
        """
        object_key = self._object_key(case_id, source)
        made = make(b"".join(self._stream(case_id, source, object_key)))
        sealed = self.seal(case_id, artefact, made)
        with self._database.writing() as session:
            row = session.get(FileRow, (case_id, source), with_for_update=True)
            is_current = row is not None and row.object_key == object_key
            left_over = attach(session, case_id, {artefact: sealed}) if is_current else [sealed.object_key]
        self.discard(case_id, left_over)
        return made

    def stream(self, case_id: str, artefact: Artefact) -> Iterator[bytes]:
        """The artefact's bytes, a frame at a time. Raises FileNotFound at once, SealBroken while reading."""
        return self._stream(case_id, artefact, self._object_key(case_id, artefact))

    def stream_object(self, case_id: str, artefact: Artefact, object_key: str) -> Iterator[bytes]:
        """The bytes of a sealed object that no artefact points at. Raises SealBroken."""
        return self._stream(case_id, artefact, object_key)

    def sealed_bytes(self, place: str) -> Iterator[bytes] | None:
        """A stored object as it is, sealed; None when there is none. place: case and object."""
        try:
            found = obstore.get(self._store, place)
        except FileNotFoundError:
            return None
        return (bytes(piece) for piece in found.stream())

    def _object_key(self, case_id: str, artefact: Artefact) -> str:
        with self._database.reading() as session:
            row = session.get(FileRow, (case_id, artefact))
            if row is None:
                raise FileNotFound(f"the case has no {artefact}")
            return row.object_key

    def _stream(self, case_id: str, artefact: Artefact, object_key: str) -> Iterator[bytes]:
        data_key = self.keys.case_key(case_id)
        try:
            found = obstore.get(self._store, _place(case_id, object_key))
        except FileNotFoundError as error:
            raise SealBroken("a stored file is missing") from error
        pieces = (bytes(piece) for piece in found.stream())
        return open_frames(pieces, data_key, object_key, case_id, artefact)

    def read(self, case_id: str, artefact: Artefact) -> bytes:
        """The whole artefact. Raises FileNotFound, SealBroken."""
        return b"".join(self.stream(case_id, artefact))

    def discard(self, case_id: str, object_keys: list[str]) -> None:
        """Remove objects that no artefact points at any more."""
        for object_key in object_keys:
            self._remove(_place(case_id, object_key))

    def remove_all(self, case_id: str) -> None:
        """Remove every object of a case, left-overs of broken uploads too. Its key must be destroyed before."""
        for page in obstore.list(self._store, prefix=case_id):
            for found in page:
                self._remove(found["path"])

    def probe(self) -> None:
        """Write, read and delete one object under a throw-away key. Raises what the store or the key raises."""
        place = f"probe/{secrets.token_hex(8)}"
        obstore.put(self._store, place, self.sealed_note(place, place.encode()))
        try:
            self.unsealed_note(place, bytes(obstore.get(self._store, place).bytes()))
        finally:
            self._remove(place)

    def check_key(self) -> None:
        """Whether the master key is still there and opens what is stored. Raises MasterKeyUnusable."""
        self.keys.check()

    def _remove(self, place: str) -> None:
        try:
            obstore.delete(self._store, place)
        except FileNotFoundError:
            return  # gone already: a deletion may be repeated

    def sealed_note(self, about: str, note: bytes) -> bytes:
        """A few bytes that belong to no case, sealed for the database. about: what they are, and whose."""
        return wrap_key(self.keys.notes, note, about)

    def unsealed_note(self, about: str, sealed: bytes) -> bytes:
        """The bytes back. Raises SealBroken when they were changed or belong elsewhere."""
        return unwrap_key(self.keys.notes, sealed, about)

    def signature(self, words: str) -> str:
        """What only this service can say of these words."""
        return signature(self.keys.notes, words)

    def new_wrapped_key(self, case_id: str) -> bytes:
        """A fresh data key for a new case, sealed under the master key."""
        return self.keys.new_case_key(case_id)


class SealedWriter:
    """One file on its way into the store. End it with `finish` or `abort`; `size` counts plain bytes."""

    def __init__(self, store: ObjectStore, case_id: str, object_key: str, sealer: FrameSealer) -> None:
        """Made by `FileVault.writer`."""
        self._store = store
        self._place = _place(case_id, object_key)
        self._object_key = object_key
        self._sealer = sealer
        self._writer = obstore.open_writer(store, self._place, buffer_size=PART)

    @property
    def size(self) -> int:
        """Plain bytes taken so far."""
        return self._sealer.size

    def write(self, data: bytes) -> None:
        """Take the next bytes."""
        sealed = self._sealer.add(data)
        if sealed:
            self._writer.write(sealed)

    def finish(self) -> Sealed:
        """Seal the end and make the object visible in the store."""
        self._writer.write(self._sealer.last())
        self._writer.close()
        return Sealed(self._object_key, self._sealer.size)

    def abort(self) -> None:
        """Leave nothing behind: the upload is closed, so that the store forgets its parts, and then removed."""
        if not self._writer.closed():
            self._writer.close()
        try:
            obstore.delete(self._store, self._place)
        except FileNotFoundError:
            return


def attach(session: Session, case_id: str, files: Mapping[Artefact, Sealed]) -> list[str]:
    """Point artefacts at new objects inside the caller's transaction; returns the objects now without a name."""
    replaced = []
    for artefact, sealed in files.items():
        row = session.get(FileRow, (case_id, artefact))
        if row is not None:
            replaced.append(row.object_key)
            session.delete(row)
            session.flush()
        session.add(
            FileRow(
                case_id=case_id,
                artefact=artefact,
                object_key=sealed.object_key,
                size=sealed.size,
                created_at=now(),
            )
        )
    return replaced


def detach(session: Session, case_id: str, but: Collection[Artefact] = ()) -> list[str]:
    """Forget the case's artefacts, but for some, inside the caller's transaction; returns their objects."""
    which = (FileRow.case_id == case_id) & FileRow.artefact.not_in(but)
    object_keys = list(session.scalars(sa.select(FileRow.object_key).where(which)))
    session.execute(sa.delete(FileRow).where(which))
    return object_keys


def _place(case_id: str, object_key: str) -> str:
    return f"{case_id}/{object_key}"
