"""Links that carry a case to another device: short-lived, used once, and kept only as hashes."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import datetime, timedelta

import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.codes import code_sha256, new_code
from lubdub.cases.database import Database
from lubdub.cases.errors import LinkSpent
from lubdub.cases.models import CaseRow, LinkRow
from lubdub.cases.rows import find, to_value
from lubdub.cases.values import Actor, Case

HANDOFF = "handoff"
LASTS = timedelta(minutes=10)


@dataclass(frozen=True)
class Handoff:
    """A link as it is shown, once. code: groups of signs a person can type."""

    code: str
    expires_at: datetime


class Links:
    """Moves cases between browser sessions."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def offer(self, actor: Actor, case_id: str) -> Handoff:
        """A new link to the case; links offered earlier stop working. Raises CaseNotFound."""
        code, moment = new_code(), now()
        with self._database.writing() as session:
            find(session, actor, case_id, to_change=True)
            session.execute(sa.delete(LinkRow).where(LinkRow.case_id == case_id, LinkRow.purpose == HANDOFF))
            session.add(
                LinkRow(
                    id=secrets.token_hex(8),
                    purpose=HANDOFF,
                    case_id=case_id,
                    token_sha256=code_sha256(HANDOFF, code),
                    expires_at=moment + LASTS,
                )
            )
            audit.append(self._database, session, actor, "handoff.offer", case_id, moment)
        return Handoff(code, moment + LASTS)

    def is_open(self, code: str) -> bool:
        """Whether the link would work now."""
        with self._database.reading() as session:
            return session.scalar(_open(code)) is not None

    def take(self, actor: Actor, code: str) -> Case:
        """Move the link's case to the actor's session; the session that had it does not see it any more.

        Raises LinkSpent.
        """
        moment = now()
        with self._database.writing() as session:
            link = session.scalar(_open(code).with_for_update())
            row = None if link is None else session.get(CaseRow, link.case_id, with_for_update=True)
            if link is None or row is None or row.deleted_at is not None:
                raise LinkSpent("handoff")
            link.used_at = moment
            row.owner_session_id = actor.id
            audit.append(self._database, session, actor, "handoff.take", row.id, moment)
            return to_value(session, row)


def _open(code: str) -> sa.Select[LinkRow]:
    return sa.select(LinkRow).where(
        LinkRow.purpose == HANDOFF,
        LinkRow.token_sha256 == code_sha256(HANDOFF, code),
        LinkRow.used_at.is_(None),
        LinkRow.expires_at > now(),
    )
