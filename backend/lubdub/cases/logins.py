"""Who an organisation's own login means: its own word for the person, once the address has led to the account."""

from __future__ import annotations

import hashlib
import json

import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.clinicians import plain_email, to_clinician
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, Vouched
from lubdub.cases.errors import SignInRefused
from lubdub.cases.models_desk import ClinicianRow


class Logins:
    """People of a login are known by its issuer and its name for them (`sub`), of which a hash is kept."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def find(self, vouched: Vouched) -> Clinician:
        """Whose account it is. Raises SignInRefused.

        An address leads to an account once. Who gets that address later is somebody else.
        """
        login = hashlib.sha256(json.dumps([vouched.issuer, vouched.subject]).encode()).hexdigest()
        known = sa.select(ClinicianRow).where(ClinicianRow.login_sha256 == login)
        by_address = sa.select(ClinicianRow).where(
            ClinicianRow.email == plain_email(vouched.email), ClinicianRow.login_sha256.is_(None)
        )
        with self._database.writing() as session:
            row = session.scalar(known)
            if row is None and vouched.email:
                row = session.scalar(by_address.with_for_update())
            if row is None or row.disabled_at is not None:
                raise SignInRefused("oidc")
            who = to_clinician(session, row)
            if row.login_sha256 is None:
                row.login_sha256 = login
                audit.append(self._database, session, who.actor, "clinician.login", None, now())
            return who
