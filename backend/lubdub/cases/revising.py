"""Changing a small artefact that several processes may change at the same moment."""

from __future__ import annotations

from collections.abc import Callable

from lubdub.cases.database import Database
from lubdub.cases.errors import SealBroken, StateConflict
from lubdub.cases.files import Artefact, FileVault, attach
from lubdub.cases.models import CaseRow, FileRow

MOST_TRIES = 20


def revise(
    database: Database, files: FileVault, case_id: str, artefact: Artefact, how: Callable[[bytes | None], bytes]
) -> bytes:
    """Store how(the artefact as it is, None before there is one). No change of another process is lost: when one came
    in between, how is asked again with what it left.

    Raises FileNotFound when the case is deleted.
    """
    for _ in range(MOST_TRIES):
        before = _object_key(database, case_id, artefact)
        try:
            revised = how(None if before is None else b"".join(files.stream_object(case_id, artefact, before)))
        except SealBroken:
            if _object_key(database, case_id, artefact) == before:
                raise
            continue  # it was replaced while we read it
        if _replaced(database, files, case_id, artefact, before, revised):
            return revised
    raise StateConflict("Others keep changing this at the same time. Try again.")


def _object_key(database: Database, case_id: str, artefact: Artefact) -> str | None:
    with database.reading() as session:
        row = session.get(FileRow, (case_id, artefact))
        return None if row is None else row.object_key


def _replaced(
    database: Database, files: FileVault, case_id: str, artefact: Artefact, before: str | None, data: bytes
) -> bool:
    """Put data in the place of the object `before`; False, and nothing done, when that is not in its place any more."""
    sealed = files.seal(case_id, artefact, data)
    left_over = [sealed.object_key]
    with database.writing() as session:
        # The case's row stands for all its artefacts, also for those that are not there yet and have no row to lock.
        session.get(CaseRow, case_id, with_for_update=True)
        row = session.get(FileRow, (case_id, artefact))
        is_current = (None if row is None else row.object_key) == before
        if is_current:
            left_over = attach(session, case_id, {artefact: sealed})
    files.discard(case_id, left_over)
    return is_current
