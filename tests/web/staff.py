"""A clinician's browser without a screen, and accounts made without walking through the pages of a running service."""

from __future__ import annotations

import html
import re
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta

import sqlalchemy as sa

from lubdub.cases.clock import now
from lubdub.cases.credentials import code_at, new_recovery_codes, new_secret
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, ClinicianSession, Joining, Role
from lubdub.cases.files import FileVault
from lubdub.cases.models_desk import ClinicianSessionRow
from lubdub.cases.people import People
from lubdub.cases.staff import Staff, Times, open_staff
from lubdub.cases.values import Actor
from lubdub.settings import Settings
from lubdub.web.deps_desk import FRESH
from lubdub.web.guard import desk_cookie_name
from tests.web.service import Service
from tests.web.visitor import Visitor

PASSWORD = "three plain words"


@contextmanager
def staff_of(settings: Settings) -> Iterator[tuple[Staff, Database]]:
    """The running service's people, from a second process."""
    database = Database(settings.database)
    vault = FileVault(database, settings.store, settings.master_key_source)
    try:
        yield open_staff(database, vault, Times()), database
    finally:
        database.close()


@dataclass
class Account:
    """Somebody at the desk who knows the password and has the code app."""

    clinician: Clinician
    secret: str
    codes: list[str]

    @property
    def code(self) -> str:
        return code_at(self.secret, time.time())


def new_account(service: Service, role: Role = "clinician", organisation: str = "Heart House") -> Account:
    """An account in an organisation, which is made when it is new."""
    with staff_of(service.settings) as (staff, database):
        key, _token = People(database).create_key(organisation, ["cases:read"])
        offered = staff.invitations.offer(Actor("key", key.id, key.tenant_id), role)
        secret, codes = new_secret(), new_recovery_codes()
        joining = Joining(f"Dr {role.title()}", f"{secrets.token_hex(4)}@heart.example")
        who = staff.invitations.accept(offered.token, joining, staff.credentials.equipped(PASSWORD, secret, codes))
    return Account(who, secret, codes)


def signed_in(service: Service, role: Role = "clinician", organisation: str = "Heart House") -> Desk:
    """A browser of a new clinician who is signed in."""
    desk, account = Desk(service), new_account(service, role, organisation)
    with staff_of(service.settings) as (staff, _database):
        desk.session = staff.sessions.open(account.clinician, "password", "test")
    desk.http.cookies.set(desk_cookie_name(service.settings), desk.session.token)
    return desk


def grow_old(service: Service, clinician: Clinician) -> None:
    """Somebody's sessions began a little too long ago for changing how to sign in."""
    with staff_of(service.settings) as (_staff, database), database.writing() as session:
        mine = sa.update(ClinicianSessionRow).where(ClinicianSessionRow.clinician_id == clinician.id)
        session.execute(mine.values(created_at=now() - FRESH - timedelta(seconds=1)))


@dataclass
class Desk(Visitor):
    """A clinician's browser at a running service."""

    session: ClinicianSession | None = None

    def token(self, path: str = "/desk/account") -> str:
        """The form token of this browser; of the sign-in page's form when nobody is signed in."""
        return hidden(self.get(path), "csrf_token")


def hidden(page: str, name: str) -> str:
    """A hidden field's value."""
    found = re.search(f'name="{name}" value="([^"]*)"', page)
    assert found is not None, page[:500]
    return html.unescape(found.group(1))
