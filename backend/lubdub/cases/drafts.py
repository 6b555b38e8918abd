"""What a family answers before there is a case: kept for its browser session, sealed, dropped when a case opens."""

from __future__ import annotations

import json
from collections.abc import Mapping

import sqlalchemy as sa

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.models import DraftRow
from lubdub.cases.values import FamilySession

Draft = Mapping[str, str]
"""Name of a question -> the answer, as it was typed or chosen."""


class Drafts:
    """One draft for each session. The database never sees an answer in the clear."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and the vault that seals."""
        self._database = database
        self._vault = vault

    def read(self, session: FamilySession) -> dict[str, str]:
        """What was answered; empty for a family that has not begun. Raises SealBroken."""
        with self._database.reading() as opened:
            row = opened.get(DraftRow, session.id)
            sealed = None if row is None else row.sealed
        return {} if sealed is None else dict(json.loads(self._vault.unsealed_note(_about(session), sealed)))

    def write(self, session: FamilySession, draft: Draft) -> None:
        """Keep these answers instead of the earlier ones."""
        sealed = self._vault.sealed_note(_about(session), json.dumps(dict(draft)).encode())
        with self._database.writing() as opened:
            opened.merge(DraftRow(session_id=session.id, sealed=sealed, updated_at=now()))

    def forget(self, session: FamilySession) -> None:
        """Drop them for good."""
        with self._database.writing() as opened:
            opened.execute(sa.delete(DraftRow).where(DraftRow.session_id == session.id))


def _about(session: FamilySession) -> str:
    return f"draft of {session.id}"
