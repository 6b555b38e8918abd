"""The master key at work: it seals and opens the keys of cases, and follows a rotation while the service runs."""

from __future__ import annotations

import logging
import secrets
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from lubdub.cases.database import Database
from lubdub.cases.errors import FileNotFound, SealBroken
from lubdub.cases.master_key import MasterKeySource, MasterKeyUnusable, NamesMasterKey, load, stamp
from lubdub.cases.models import CaseKeyRow, FamilySessionRow, ServiceKeyRow, TenantRow
from lubdub.cases.sealing import KEY_BYTES, note_key, unwrap_key, wrap_key

NOTES = "notes"

log = logging.getLogger(__name__)


class KeyChain:
    """Every key there is, each reached through the one above it. Cases' keys are never kept in memory."""

    def __init__(self, database: Database, named: NamesMasterKey | Path) -> None:
        """Over an open database; Raises MasterKeyUnusable."""
        self._database = database
        self.source = MasterKeySource.of(named)
        with database.reading() as session:
            is_in_use = _newest(session) is not None or session.get(ServiceKeyRow, NOTES) is not None
        self._stamp = stamp(self.source)
        self._masters = load(self.source, may_make=not is_in_use)
        if not self._fits(self._masters):
            raise MasterKeyUnusable(
                f"The {self.source.name} is not the one that sealed what is stored here. "
                "Put the right one in its place."
            )
        self._notes = self._notes_key()
        database.info["keys"] = self

    def masters(self) -> tuple[bytes, ...]:
        """The master keys, the current one first; read anew when the file changed and still fits what is stored."""
        current = stamp(self.source)
        if current not in (None, self._stamp):
            try:
                found = load(self.source, may_make=False)
                fits = self._fits(found)
            except MasterKeyUnusable:
                fits = False
            if not fits:
                log.error("the master key was exchanged for one that does not fit; the old one is used on")
                return self._masters
            self._masters, self._stamp = found, current
        return self._masters

    def wrap(self, key: bytes, about: str) -> bytes:
        """A key sealed under the current master key."""
        return wrap_key(self.masters()[0], key, about)

    def unwrap(self, wrapped: bytes, about: str) -> bytes:
        """The key back, whichever master key sealed it. Raises SealBroken."""
        return unwrapped(self.masters(), wrapped, about)

    def new_case_key(self, case_id: str) -> bytes:
        """A fresh data key for a new case, sealed."""
        return self.wrap(secrets.token_bytes(KEY_BYTES), case_id)

    def case_key(self, case_id: str) -> bytes:
        """The case's data key. Raises FileNotFound when it is destroyed."""
        with self._database.reading() as session:
            return self.case_key_in(session, case_id)

    def case_key_in(self, session: Session, case_id: str) -> bytes:
        """The same inside a transaction of the caller's."""
        row = session.get(CaseKeyRow, case_id)
        if row is None:
            raise FileNotFound("the case's key is destroyed")
        return self.unwrap(row.wrapped_key, case_id)

    @property
    def notes(self) -> bytes:
        """The key of short notes in the database that belong to no case."""
        return self._notes

    def check(self) -> None:
        """Whether the master key is still where it was and opens what is stored. Raises MasterKeyUnusable."""
        if not self._fits(load(self.source, may_make=False)):
            raise MasterKeyUnusable(
                f"The {self.source.name} was exchanged while the service runs, and does not open what is stored. "
                "Put the right one back."
            )

    def _fits(self, masters: tuple[bytes, ...]) -> bool:
        with self._database.reading() as session:
            notes, newest = session.get(ServiceKeyRow, NOTES), _newest(session)
        try:
            if notes is not None:
                unwrapped(masters, notes.wrapped_key, NOTES)
            if newest is not None:
                unwrapped(masters, newest.wrapped_key, newest.case_id)
        except SealBroken:
            return False
        return True

    def _notes_key(self) -> bytes:
        try:
            with self._database.writing() as session:
                row = session.get(ServiceKeyRow, NOTES)
                if row is None:
                    key = secrets.token_bytes(KEY_BYTES) if _is_new(session) else note_key(self._masters[0])
                    row = ServiceKeyRow(name=NOTES, wrapped_key=self.wrap(key, NOTES))
                    session.add(row)
                wrapped = row.wrapped_key
        except IntegrityError:  # another process starts at the same moment
            return self._notes_key()
        return self.unwrap(wrapped, NOTES)


def unwrapped(masters: tuple[bytes, ...], wrapped: bytes, about: str) -> bytes:
    """The key back, whichever of the master keys sealed it. Raises SealBroken."""
    for master in masters[:-1]:
        try:
            return unwrap_key(master, wrapped, about)
        except SealBroken:
            continue
    return unwrap_key(masters[-1], wrapped, about)


def _newest(session: Session) -> CaseKeyRow | None:
    return session.scalar(sa.select(CaseKeyRow).order_by(CaseKeyRow.created_at.desc()).limit(1))


def _is_new(session: Session) -> bool:
    """Whether nothing can have been sealed yet. The key of notes was once derived from the master key itself."""
    organisations = session.scalar(sa.select(sa.func.count()).select_from(TenantRow)) or 0
    return organisations <= 1 and session.scalar(sa.select(FamilySessionRow.id).limit(1)) is None
