"""A new master key while the service runs: first it is added, then every case's key is sealed anew, then the old goes.

The keys of cases stay what they are, so nothing in the store is touched. Broken off at any point, it goes on where it
was: what is still sealed under an old key shows by itself.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import SealBroken
from lubdub.cases.key_chain import KeyChain
from lubdub.cases.master_key import MasterKeyUnusable, fingerprint, keep_current_alone, put_in_front
from lubdub.cases.models import Base, CaseKeyRow, ServiceKeyRow
from lubdub.cases.sealing import KEY_BYTES, unwrap_key
from lubdub.cases.values import SYSTEM

AT_ONCE = 200
"""Keys sealed anew in one transaction; the service's own writers wait for no longer than that takes."""
SETTLES_S = 60.0
"""By then nothing is under way any more that was sealed before the new key stood in the file."""

Tell = Callable[[int], None]


class CannotRotate(Exception):
    """The text is one sentence for the person who runs the service."""


@dataclass(frozen=True)
class Standing:
    """fingerprints: of the master keys, the current one first; behind: how many keys are sealed under old ones."""

    fingerprints: tuple[str, ...]
    sealed: int
    behind: int


class Rotation:
    """Rotates the master key of an open key chain."""

    def __init__(self, database: Database, keys: KeyChain) -> None:
        """Over open services."""
        self._database = database
        self._keys = keys

    def standing(self) -> Standing:
        """How things are. Raises SealBroken for a key that no master key opens."""
        masters = self._keys.masters()
        behind = total = 0
        for batch in self._batches():
            total += len(batch)
            behind += sum(self._is_behind(about, wrapped) for _, about, wrapped in batch)
        return Standing(tuple(map(fingerprint, masters)), total, behind)

    def begin(self) -> bool:
        """Put a new key in front; False when one is there already. Raises CannotRotate, MasterKeyUnusable."""
        if len(self._keys.masters()) > 1:
            return False
        if self._keys.source.text:
            raise CannotRotate(
                "The master key is in LUBDUB_MASTER_KEY: put a new one and a comma before it (./lubdub admin "
                "master-key new prints one), start the service again, and then run this again."
            )
        put_in_front(self._keys.source, secrets.token_bytes(KEY_BYTES))
        if len(self._keys.masters()) == 1:
            raise MasterKeyUnusable(f"The {self._keys.source.name} could not be read again after it was changed.")
        self._note("master_key.rotate")
        return True

    def seal_anew(self, tell: Tell = lambda done: None) -> int:
        """Seal under the current key whatever is under an older one; how many there were. tell: how many so far."""
        done = 0
        while True:
            before = done
            for batch in self._batches():
                done += self._seal_batch(batch)
                tell(done)
            if done == before:
                break  # a whole pass found nothing: also what was made meanwhile is under the current key
        self._database.forget_traces()
        return done

    def retire(self) -> int:
        """Drop the old master keys; how many. Raises CannotRotate while something may still need them."""
        old = len(self._keys.masters()) - 1
        if old < 1:
            raise CannotRotate("There is no old master key.")
        if self._keys.source.text:
            self.seal_anew()
            raise CannotRotate(
                "Nothing needs the old master keys any more: take them out of LUBDUB_MASTER_KEY, from the comma on, "
                "and start the service again."
            )
        age = time.time() - self._keys.source.file.stat().st_mtime
        if age < SETTLES_S:
            raise CannotRotate(f"The new master key is too young: try again in {SETTLES_S - age:.0f} seconds.")
        self.seal_anew()
        keep_current_alone(self._keys.source)
        self._note("master_key.retire")
        return old

    def _batches(self) -> Iterator[list[tuple[type[Base], str, bytes]]]:
        """Every sealed key with what it is about, some at a time and in order, each batch read for itself."""
        with self._database.reading() as session:
            rows = session.execute(sa.select(ServiceKeyRow.name, ServiceKeyRow.wrapped_key))
            batch: list[tuple[type[Base], str, bytes]] = [(ServiceKeyRow, name, wrapped) for name, wrapped in rows]
        yield batch
        last = ""
        while True:
            query = sa.select(CaseKeyRow.case_id, CaseKeyRow.wrapped_key).where(CaseKeyRow.case_id > last)
            with self._database.reading() as session:
                found = session.execute(query.order_by(CaseKeyRow.case_id).limit(AT_ONCE)).all()
            if not found:
                return
            yield [(CaseKeyRow, case_id, wrapped) for case_id, wrapped in found]
            last = found[-1].case_id

    def _seal_batch(self, batch: list[tuple[type[Base], str, bytes]]) -> int:
        """A key that went meanwhile, with its case, does not come back: only what is still there is written over."""
        changed = 0
        behind = [one for one in batch if self._is_behind(one[1], one[2])]
        if not behind:
            return 0
        with self._database.writing() as session:
            for table, about, wrapped in behind:
                columns = table.__table__.c
                is_it = (CaseKeyRow.case_id if table is CaseKeyRow else ServiceKeyRow.name) == about
                anew = self._keys.wrap(self._keys.unwrap(wrapped, about), about)
                query = sa.update(table).where(is_it, columns.wrapped_key == wrapped).values(wrapped_key=anew)
                changed += session.execute(query).rowcount  # type: ignore[attr-defined]
        return changed

    def _is_behind(self, about: str, wrapped: bytes) -> bool:
        try:
            unwrap_key(self._keys.masters()[0], wrapped, about)
        except SealBroken:
            return True
        return False

    def _note(self, action: str) -> None:
        with self._database.writing() as session:
            detail = fingerprint(self._keys.masters()[0])
            audit.append(self._database, session, SYSTEM, action, None, now(), detail)
