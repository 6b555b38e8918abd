"""Signed-in browsers of the desk: they end by themselves, when idle and at the latest after a working day."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from datetime import timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clinicians import to_clinician
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, ClinicianSession, How
from lubdub.cases.models_desk import ClinicianRow, ClinicianSessionRow
from lubdub.cases.people import SEEN_EVERY, TOKEN_BYTES, token_sha256

LONGEST_DEVICE = 200


class DeskSessions:
    """The sessions of all clinicians. idle: without a call; longest: from signing in, whatever happens."""

    def __init__(self, database: Database, idle: timedelta, longest: timedelta) -> None:
        """Over an open database."""
        self._database = database
        self._idle = idle
        self._longest = longest

    def open(self, clinician: Clinician, how: How, device: str) -> ClinicianSession:
        """A new session. device: how the browser names itself, so that its owner knows it again in the list."""
        token, moment = secrets.token_urlsafe(TOKEN_BYTES), now()
        row = ClinicianSessionRow(
            id=secrets.token_hex(8),
            clinician_id=clinician.id,
            token_sha256=token_sha256(token),
            how=how,
            device=device[:LONGEST_DEVICE],
            created_at=moment,
            seen_at=moment,
            expires_at=moment + self._longest,
        )
        with self._database.writing() as session:
            session.add(row)
            audit.append(self._database, session, clinician.actor, "sign_in", None, moment, how)
            return _to_value(row, token, clinician)

    def session_of(self, token: str) -> ClinicianSession | None:
        """The living session behind a cookie of somebody who still has an account; being asked keeps it awake."""
        with self._database.reading() as session:
            row = session.scalar(self._living().where(ClinicianSessionRow.token_sha256 == token_sha256(token)))
            found = None if row is None else _to_value(row, token, _owner(session, row))
        if found is None or found.clinician.disabled_at is not None:
            return None
        if now() - found.seen_at >= SEEN_EVERY:
            with self._database.writing() as session:
                seen = sa.update(ClinicianSessionRow).where(ClinicianSessionRow.id == found.id)
                session.execute(seen.values(seen_at=now()))
        return found

    def is_living(self, session_id: str) -> bool:
        """Whether the session still counts, and its owner still has an account. Being asked does not keep it awake."""
        query = self._living().join(ClinicianRow, ClinicianRow.id == ClinicianSessionRow.clinician_id)
        query = query.where(ClinicianSessionRow.id == session_id, ClinicianRow.disabled_at.is_(None))
        with self._database.reading() as session:
            return session.scalar(query) is not None

    def list_living(self, clinician: Clinician) -> Sequence[ClinicianSession]:
        """Somebody's sessions, the latest seen first. Their tokens are not known."""
        query = self._living().where(ClinicianSessionRow.clinician_id == clinician.id)
        with self._database.reading() as session:
            rows = session.scalars(query.order_by(ClinicianSessionRow.seen_at.desc()))
            return [_to_value(row, "", clinician) for row in rows]

    def end(self, clinician: Clinician, session_id: str) -> bool:
        """End one of somebody's own sessions. False when there is no such one."""
        with self._database.writing() as session:
            row = session.get(ClinicianSessionRow, session_id)
            if row is None or row.clinician_id != clinician.id:
                return False
            session.delete(row)
            audit.append(self._database, session, clinician.actor, "sign_out", None, now())
            return True

    def end_others(self, clinician: Clinician, kept_id: str) -> None:
        """End all of somebody's sessions but one."""
        with self._database.writing() as session:
            session.execute(
                sa.delete(ClinicianSessionRow).where(
                    ClinicianSessionRow.clinician_id == clinician.id, ClinicianSessionRow.id != kept_id
                )
            )
            audit.append(self._database, session, clinician.actor, "sign_out", None, now(), "all other sessions")

    def _living(self) -> sa.Select[ClinicianSessionRow]:
        moment = now()
        return sa.select(ClinicianSessionRow).where(
            ClinicianSessionRow.expires_at > moment, ClinicianSessionRow.seen_at > moment - self._idle
        )


def _owner(session: Session, row: ClinicianSessionRow) -> Clinician:
    return to_clinician(session, session.get_one(ClinicianRow, row.clinician_id))


def _to_value(row: ClinicianSessionRow, token: str, clinician: Clinician) -> ClinicianSession:
    return ClinicianSession(
        id=row.id,
        token=token,
        clinician=clinician,
        how=row.how,  # type: ignore[arg-type]  # only How words are ever written
        device=row.device,
        created_at=row.created_at,
        seen_at=row.seen_at,
        expires_at=row.expires_at,
    )
