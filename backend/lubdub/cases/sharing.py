"""A family's separate yes: the shape of a signed case may become a reference body. It can be taken back."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import StateConflict
from lubdub.cases.models import CaseRow
from lubdub.cases.rows import find, to_value
from lubdub.cases.values import SYSTEM, Actor, Case

SHARING_VERSION = "1"
"""Of the words agreed to. Count up when they change."""


@dataclass(frozen=True)
class SharingYes:
    """A family's separate yes. version: of the words agreed to; language: they were read in."""

    version: str
    language: str
    given_at: datetime


class Sharing:
    """Who agreed to what. Raises CaseNotFound for cases of others."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def agree(self, actor: Actor, case_id: str, language: str) -> Case:
        """Keep the yes with its version, language and time. Raises StateConflict before a clinician signed."""
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if row.status != "reviewed":
                raise StateConflict("Only a case that a clinician has signed can be shared.")
            if row.sharing is None:
                row.sharing = _kept(SharingYes(SHARING_VERSION, language, now()), actor)
                audit.append(self._database, session, actor, "sharing.agree", row.id, now())
            return to_value(session, row)

    def keep(self, actor: Actor, case_id: str, yes: SharingYes) -> SharingYes:
        """Keep the yes that a portal holds, in place of an earlier one. It may come early; it counts once a clinician
        has signed. Raises StateConflict for a made-up case."""
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if row.person == "sample":
                raise StateConflict("This is a made-up case: there is nobody who could agree.")
            row.sharing = _kept(yes, actor)
            audit.append(self._database, session, actor, "sharing.agree", row.id, now())
            return yes

    def read(self, actor: Actor, case_id: str) -> SharingYes | None:
        """The yes as it was given; None when nobody agreed, or it was taken back."""
        with self._database.reading() as session:
            said = find(session, actor, case_id).sharing
            if said is None:
                return None
            return SharingYes(said["version"], said["language"], datetime.fromisoformat(said["given_at"]))

    def take_back(self, actor: Actor, case_id: str) -> Case:
        """The yes is taken back; the body made of it must go."""
        with self._database.writing() as session:
            row = find(session, actor, case_id, to_change=True)
            if row.sharing is not None:
                row.sharing = None
                audit.append(self._database, session, actor, "sharing.take_back", row.id, now())
            return to_value(session, row)

    def shared_case(self, case_id: str) -> Case:
        """A case that may become a reference body now. Raises CaseNotFound, StateConflict with the sentence why not."""
        with self._database.writing() as session:
            row = find(session, SYSTEM, case_id)
            if row.status != "reviewed":
                raise StateConflict("No clinician has signed this case.")
            if row.sharing is None:
                raise StateConflict("The family has not agreed that the shape is kept as a reference body.")
            if row.posture != "supine":
                raise StateConflict("All reference bodies lie on their backs; this one sits.")
            audit.append(self._database, session, SYSTEM, "sharing.use", row.id, now())
            return to_value(session, row)

    def is_known_to(self, actor: Actor, case_id: str) -> bool:
        """Whether the case is one of the actor's organisation: its body is shown to nobody else."""
        with self._database.reading() as session:
            row = session.get(CaseRow, case_id)
            return row is not None and row.tenant_id == actor.tenant_id

    def still_shared(self, case_id: str) -> bool:
        """Whether the yes still stands: neither taken back nor deleted with the case."""
        with self._database.reading() as session:
            row = session.get(CaseRow, case_id)
            return row is not None and row.deleted_at is None and row.sharing is not None


def _kept(yes: SharingYes, actor: Actor) -> dict[str, str]:
    """As it is kept, with whom it came through."""
    said = {"version": yes.version, "language": yes.language, "given_at": yes.given_at.isoformat()}
    return said | {"by": actor.name, "kept_at": now().isoformat()}
