"""Passkeys: their public halves, and the challenges that browsers sign, each once and soon."""

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
from lubdub.cases.desk_values import Clinician, NewPasskey, Passkey
from lubdub.cases.errors import NotAllowed, SignInRefused
from lubdub.cases.invitations import Equip
from lubdub.cases.models_desk import ChallengeRow, ClinicianRow, PasskeyRow
from lubdub.cases.people import token_sha256

CHALLENGE_BYTES = 32
CHALLENGE_LASTS = timedelta(minutes=5)


class Passkeys:
    """The passkeys of all clinicians. What browsers sign is checked by who asks here, with what is kept here."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def new_challenge(self, browser: str) -> bytes:
        """Something to sign for the browser with this cookie; an earlier challenge of its is void."""
        challenge = secrets.token_bytes(CHALLENGE_BYTES)
        row = ChallengeRow(
            browser_sha256=token_sha256(browser), challenge=challenge, expires_at=now() + CHALLENGE_LASTS
        )
        with self._database.writing() as session:
            session.merge(row)
        return challenge

    def take_challenge(self, browser: str) -> bytes:
        """What the browser was asked to sign. It is asked for once. Raises SignInRefused when nothing was."""
        with self._database.writing() as session:
            row = session.get(ChallengeRow, token_sha256(browser), with_for_update=True)
            if row is None:
                raise SignInRefused("challenge")
            session.delete(row)
            is_late, challenge = row.expires_at < now(), row.challenge
        if is_late:
            raise SignInRefused("challenge")
        return challenge

    def equipped(self, new: NewPasskey) -> Equip:
        """Gives a new account this passkey."""

        def equip(session: Session, row: ClinicianRow) -> None:
            session.add(_new_row(row.id, new))

        return equip

    def add(self, clinician: Clinician, new: NewPasskey) -> None:
        """One more passkey for an account."""
        with self._database.writing() as session:
            row = _new_row(clinician.id, new)
            session.add(row)
            audit.append(self._database, session, clinician.actor, "passkey.add", None, now(), row.id)

    def list_of(self, clinician: Clinician) -> Sequence[Passkey]:
        """An account's passkeys, oldest first."""
        query = sa.select(PasskeyRow).where(PasskeyRow.clinician_id == clinician.id).order_by(PasskeyRow.created_at)
        with self._database.reading() as session:
            return [_to_value(row) for row in session.scalars(query)]

    def remove(self, clinician: Clinician, passkey_id: str) -> None:
        """Forget a passkey of the own account. Raises NotAllowed for the only way to sign in."""
        with self._database.writing() as session:
            row = session.get(PasskeyRow, passkey_id, with_for_update=True)
            if row is None or row.clinician_id != clinician.id:
                return
            owner = session.get_one(ClinicianRow, clinician.id)
            others = sa.select(PasskeyRow.id).where(
                PasskeyRow.clinician_id == clinician.id, PasskeyRow.id != passkey_id
            )
            if owner.password_hash is None and session.scalar(others) is None:
                raise NotAllowed("This is your only way to sign in. Add another one first.")
            session.delete(row)
            audit.append(self._database, session, clinician.actor, "passkey.remove", None, now(), passkey_id)

    def find(self, credential_id: bytes) -> tuple[Passkey, Clinician]:
        """The passkey that a browser presents, and whose it is. Raises SignInRefused."""
        with self._database.reading() as session:
            row = session.scalar(sa.select(PasskeyRow).where(PasskeyRow.credential_id == credential_id))
            if row is None:
                raise SignInRefused("passkey")
            owner = to_clinician(session, session.get_one(ClinicianRow, row.clinician_id))
            if owner.disabled_at is not None:
                raise SignInRefused("passkey")
            return _to_value(row), owner

    def note_use(self, passkey: Passkey, sign_count: int) -> None:
        """It was used, and its authenticator says that it signed so often."""
        with self._database.writing() as session:
            row = session.get(PasskeyRow, passkey.id, with_for_update=True)
            if row is not None:
                row.sign_count, row.last_used_at = sign_count, now()


def _new_row(clinician_id: str, new: NewPasskey) -> PasskeyRow:
    return PasskeyRow(
        id=secrets.token_hex(8),
        clinician_id=clinician_id,
        credential_id=new.credential_id,
        public_key=new.public_key,
        sign_count=new.sign_count,
        device=new.device[:200],
        created_at=now(),
    )


def _to_value(row: PasskeyRow) -> Passkey:
    return Passkey(
        id=row.id,
        clinician_id=row.clinician_id,
        credential_id=row.credential_id,
        public_key=row.public_key,
        sign_count=row.sign_count,
        device=row.device,
        created_at=row.created_at,
        last_used_at=row.last_used_at,
    )
