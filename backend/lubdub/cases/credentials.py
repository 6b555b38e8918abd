"""Signing in by password and second factor: Argon2id, codes by time (RFC 6238) and recovery codes."""

from __future__ import annotations

import base64
import binascii
import secrets
import time
from datetime import timedelta

import sqlalchemy as sa
from cryptography.hazmat.primitives.hashes import SHA1
from cryptography.hazmat.primitives.twofactor import InvalidToken
from cryptography.hazmat.primitives.twofactor.totp import TOTP
from pwdlib import PasswordHash
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.attempts import Attempts, Limit
from lubdub.cases.clinicians import plain_email, to_clinician
from lubdub.cases.clock import now
from lubdub.cases.codes import code_sha256, new_code
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, How
from lubdub.cases.errors import SignInRefused
from lubdub.cases.files import FileVault
from lubdub.cases.invitations import Equip
from lubdub.cases.models_desk import ClinicianRow, RecoveryCodeRow
from lubdub.cases.passwords import LONGEST_PASSWORD

SECRET_BYTES = 20
STEP_S, DIGITS = 30, 6
DRIFT_STEPS = (0, -1, 1)
"""A phone's clock may be half a minute off either way."""
RECOVERY_CODES = 8
RECOVERY = "recovery"
OF_ACCOUNT = Limit(10, timedelta(minutes=15))
OF_ADDRESS = Limit(50, timedelta(minutes=15))
"""An address may stand for a whole clinic."""
ISSUER = "Lubdub"


class Credentials:
    """Passwords with their second factor. Neither opens anything alone."""

    def __init__(self, database: Database, vault: FileVault, attempts: Attempts) -> None:
        """Over an open database, the vault that seals secrets, and the count of tries."""
        self._database = database
        self._vault = vault
        self._attempts = attempts
        self._hasher = PasswordHash.recommended()
        self._nobodys = self._hasher.hash(secrets.token_urlsafe())

    def equipped(self, password: str, secret: str, codes: list[str]) -> Equip:
        """Gives a new account this password and second factor. secret: as made by `new_secret` and confirmed."""
        hashed = self._hasher.hash(password)

        def equip(session: Session, row: ClinicianRow) -> None:
            row.password_hash = hashed
            row.second_factor = self._vault.sealed_note(_about(row.id), _secret_bytes(secret))
            row.last_code_step = 0
            session.execute(sa.delete(RecoveryCodeRow).where(RecoveryCodeRow.clinician_id == row.id))
            session.add_all(RecoveryCodeRow(clinician_id=row.id, code_sha256=code_sha256(RECOVERY, c)) for c in codes)

        return equip

    def replace(self, clinician: Clinician, password: str, secret: str, codes: list[str]) -> None:
        """Give an account a new password, second factor and recovery codes."""
        equip = self.equipped(password, secret, codes)
        with self._database.writing() as session:
            equip(session, session.get_one(ClinicianRow, clinician.id, with_for_update=True))
            audit.append(self._database, session, clinician.actor, "clinician.password", None, now())

    def sign_in(self, email: str, password: str, code: str, address: str) -> tuple[Clinician, How]:
        """Who signs in, and how. address: of the caller's machine. Raises SignInRefused, TooManyTries."""
        account = f"sign-in {plain_email(email)}"
        self._attempts.count(f"sign-in from {address}", OF_ADDRESS)
        self._attempts.count(account, OF_ACCOUNT)
        with self._database.reading() as session:
            row = session.scalar(_living(email))
            hashed = None if row is None else row.password_hash
        is_it = self._is_password(password, hashed)
        if row is None or not is_it:
            self._note_refusal(row)
            raise SignInRefused(email)
        how = self._take_code(row.id, code)
        if how is None:
            self._note_refusal(row)
            raise SignInRefused(email)
        self._attempts.forget(account)
        with self._database.reading() as session:
            return to_clinician(session, session.get_one(ClinicianRow, row.id)), how

    def knows_password(self, clinician: Clinician, password: str) -> bool:
        """Whether it is the account's password now. Tries are counted with those of signing in. Raises TooManyTries."""
        account = f"sign-in {plain_email(clinician.email)}"
        self._attempts.count(account, OF_ACCOUNT)
        with self._database.reading() as session:
            row = session.get_one(ClinicianRow, clinician.id)
        is_it = self._is_password(password, row.password_hash)
        if is_it:
            self._attempts.forget(account)
        else:
            self._note_refusal(row)
        return is_it

    def _is_password(self, password: str, hashed: str | None) -> bool:
        """As it was typed. One that is too long, or nobody's, takes as long to refuse as any other."""
        is_taken = len(password) <= LONGEST_PASSWORD
        fits = self._hasher.verify(password if is_taken else "", hashed or self._nobodys)
        return fits and is_taken and hashed is not None

    def _take_code(self, clinician_id: str, code: str) -> How | None:
        """How the code fits; neither a code of the app nor a recovery code works twice."""
        with self._database.writing() as session:
            row = session.get_one(ClinicianRow, clinician_id, with_for_update=True)
            if row.second_factor is None:
                return None
            secret = self._vault.unsealed_note(_about(row.id), row.second_factor)
            step = step_of(secret, code)
            if step is not None and step > row.last_code_step:
                row.last_code_step = step
                return "password"
            spare = session.get(RecoveryCodeRow, (clinician_id, code_sha256(RECOVERY, code)))
            if spare is None:
                return None
            session.delete(spare)
            return "recovery"

    def _note_refusal(self, row: ClinicianRow | None) -> None:
        if row is None:
            return
        with self._database.writing() as session:
            actor = to_clinician(session, session.get_one(ClinicianRow, row.id)).actor
            audit.append(self._database, session, actor, "sign_in.refused", None, now())


def new_secret() -> str:
    """A secret for a code app, as apps show it (base 32)."""
    return base64.b32encode(secrets.token_bytes(SECRET_BYTES)).decode()


def new_recovery_codes() -> list[str]:
    """Codes to be kept on paper."""
    return [new_code() for _ in range(RECOVERY_CODES)]


def is_secret(text: str) -> bool:
    """Whether it is one that `new_secret` could have made."""
    try:
        return len(_secret_bytes(text)) == SECRET_BYTES
    except binascii.Error:
        return False


def provisioning_uri(secret: str, email: str) -> str:
    """What a code app reads from the picture code."""
    return _totp(_secret_bytes(secret)).get_provisioning_uri(email, ISSUER)


def fits(secret: str, code: str) -> bool:
    """Whether the app shows this code now: the proof that it took the secret over."""
    return step_of(_secret_bytes(secret), code) is not None


def step_of(secret: bytes, code: str) -> int | None:
    """The half minute to which a code belongs, or None when it fits none of those near now."""
    plain = code.replace(" ", "")
    if len(plain) != DIGITS or not plain.isascii() or not plain.isdigit():
        return None
    moment = int(time.time())
    for drift in DRIFT_STEPS:
        at = moment + drift * STEP_S
        try:
            _totp(secret).verify(plain.encode(), at)
        except InvalidToken:
            continue
        return at // STEP_S
    return None


def code_at(secret: str, moment: float) -> str:
    """What a code app shows at this moment (seconds since 1970)."""
    return _totp(_secret_bytes(secret)).generate(int(moment)).decode()


def _totp(secret: bytes) -> TOTP:
    # SHA-1 as HMAC is what every code app computes (RFC 6238); collisions do not matter for it.
    return TOTP(secret, DIGITS, SHA1(), STEP_S)  # nosec B303


def _secret_bytes(secret: str) -> bytes:
    return base64.b32decode(secret.encode())


def _about(clinician_id: str) -> str:
    return f"second factor of {clinician_id}"


def _living(email: str) -> sa.Select[ClinicianRow]:
    return sa.select(ClinicianRow).where(ClinicianRow.email == plain_email(email), ClinicianRow.disabled_at.is_(None))
