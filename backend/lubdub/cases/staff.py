"""Everything about the people at the desk, opened together."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from lubdub.cases.attempts import Attempts
from lubdub.cases.clinicians import Clinicians
from lubdub.cases.credentials import Credentials
from lubdub.cases.database import Database
from lubdub.cases.desk_sessions import DeskSessions
from lubdub.cases.family_invitations import FamilyInvitations
from lubdub.cases.files import FileVault
from lubdub.cases.holds import Holds
from lubdub.cases.invitations import Invitations
from lubdub.cases.logins import Logins
from lubdub.cases.passkeys import Passkeys
from lubdub.cases.trail import Trail


@dataclass(frozen=True)
class Staff:
    """Accounts, the links that make them, the ways to sign in, and what is open."""

    clinicians: Clinicians
    invitations: Invitations
    credentials: Credentials
    passkeys: Passkeys
    logins: Logins
    sessions: DeskSessions
    families: FamilyInvitations
    trail: Trail
    holds: Holds


@dataclass(frozen=True)
class Times:
    """How long a session lasts unused (idle) and at all (longest), and how long a family's link works."""

    idle: timedelta = timedelta(hours=1)
    longest: timedelta = timedelta(hours=12)
    family_link: timedelta = timedelta(days=14)


def open_staff(database: Database, vault: FileVault, times: Times) -> Staff:
    """Over an open database and vault."""
    return Staff(
        clinicians=Clinicians(database),
        invitations=Invitations(database),
        credentials=Credentials(database, vault, Attempts(database)),
        passkeys=Passkeys(database),
        logins=Logins(database),
        sessions=DeskSessions(database, times.idle, times.longest),
        families=FamilyInvitations(database, vault, times.family_link),
        trail=Trail(database),
        holds=Holds(database),
    )
