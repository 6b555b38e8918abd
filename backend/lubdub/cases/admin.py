"""What the person who runs the service does by command: portal keys and clinicians. All raise CannotOpen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

from lubdub.cases.clinicians import Clinicians
from lubdub.cases.database import Database
from lubdub.cases.desk_values import Clinician, Offered, Role
from lubdub.cases.invitations import Invitations
from lubdub.cases.opening import open_database
from lubdub.cases.people import SCOPES, People
from lubdub.cases.values import SYSTEM, Actor, PortalKey


def create_key(
    database_url: str, name: str, scopes: Sequence[str] = SCOPES, is_sandbox: bool = False
) -> tuple[PortalKey, str]:
    """A key for the portal called name, and its token, which is shown this once. Raises ValueError."""
    with _opened(database_url) as database:
        return People(database).create_key(name, scopes, is_sandbox)


def list_keys(database_url: str) -> list[PortalKey]:
    """All keys, oldest first."""
    with _opened(database_url) as database:
        return People(database).list_keys()


def revoke_key(database_url: str, key_id: str) -> bool:
    """End a key. False when there is no such living key."""
    with _opened(database_url) as database:
        return People(database).revoke_key(key_id)


def first_link(database_url: str) -> Offered | None:
    """A link for the very first clinician; None when somebody is here already."""
    with _opened(database_url) as database:
        return Invitations(database).offer_first()


def list_clinicians(database_url: str) -> list[Clinician]:
    """The clinicians of all organisations, oldest first."""
    with _opened(database_url) as database:
        return Clinicians(database).list_all()


def invite_beside(database_url: str, email: str, role: Role) -> Offered | None:
    """A link into the organisation of the clinician with this address; None when there is nobody of that address."""
    with _opened(database_url) as database:
        colleague = Clinicians(database).find(email)
        if colleague is None:
            return None
        return Invitations(database).offer(Actor("system", SYSTEM.id, colleague.tenant_id), role)


def renew_clinician(database_url: str, email: str) -> Offered | None:
    """A link for new ways to sign in; None when there is nobody of that address."""
    with _opened(database_url) as database:
        found = Clinicians(database).find(email)
        return None if found is None else Invitations(database).offer_renewal(SYSTEM, found.id)


def change_clinician(database_url: str, email: str, change: Role | Literal["disable", "enable"]) -> bool:
    """Give the clinician with this address another role, or shut the account, or open it again.

    False when there is nobody of that address. Raises NotAllowed.
    """
    with _opened(database_url) as database:
        clinicians = Clinicians(database)
        found = clinicians.find(email)
        if found is None:
            return False
        if change == "disable":
            clinicians.disable(SYSTEM, found.id)
        elif change == "enable":
            clinicians.enable(SYSTEM, found.id)
        else:
            clinicians.change_role(SYSTEM, found.id, change)
        return True


@contextmanager
def _opened(database_url: str) -> Iterator[Database]:
    database = open_database(database_url)
    try:
        yield database
    finally:
        database.close()
