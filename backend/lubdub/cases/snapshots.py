"""How the cases stand that are being looked at live: for processes that keep pictures of them, and must follow."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.files import Artefact
from lubdub.cases.models import CaseRow, FileRow


@dataclass(frozen=True)
class Snapshot:
    """Whose the case is, and artefact -> the object that is this artefact now: another one when it was changed."""

    owner: str | None
    files: Mapping[str, str] = field(default_factory=dict)

    def version(self, artefact: Artefact) -> str:
        """A word that changes with the artefact, and says nothing of where it lies."""
        return hashlib.sha256(self.files.get(artefact, "").encode()).hexdigest()[:16]


class Snapshots:
    """Looks many cases up at once, so that following them costs the same however many there are."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def of(self, case_ids: Collection[str]) -> Mapping[str, Snapshot]:
        """Case id -> how it stands. A deleted case is missing."""
        if not case_ids:
            return {}
        lives = CaseRow.id.in_(case_ids) & CaseRow.deleted_at.is_(None)
        rows = (
            sa.select(CaseRow.id, CaseRow.owner_session_id, FileRow.artefact, FileRow.object_key)
            .outerjoin(FileRow, FileRow.case_id == CaseRow.id)
            .where(lives)
        )
        owners: dict[str, str | None] = {}
        files: dict[str, dict[str, str]] = {}
        with self._database.reading() as session:
            for case_id, owner, artefact, object_key in session.execute(rows):
                owners[case_id] = owner
                if artefact is not None:
                    files.setdefault(case_id, {})[artefact] = object_key
        return {case_id: Snapshot(owner, files.get(case_id, {})) for case_id, owner in owners.items()}

    def one(self, case_id: str) -> Snapshot | None:
        """How one case stands; None when it is deleted."""
        return self.of([case_id]).get(case_id)
