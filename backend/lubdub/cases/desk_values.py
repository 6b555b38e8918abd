"""The values of the desk: its people, what they may do, and how they are signed in."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from lubdub.cases.states import Status
from lubdub.cases.values import Actor

Role = Literal["clinician", "lead", "administrator"]
ROLES: tuple[Role, ...] = ("clinician", "lead", "administrator")
"""Each may do what those before it may: review; also read the audit trail; also let people in and out."""
How = Literal["passkey", "password", "recovery", "oidc", "oidc-asked"]
"""oidc: an organisation's login, which may have remembered its person; oidc-asked: it says that it asked just now."""


def may(role: Role, least: Role) -> bool:
    """Whether somebody in this role may do what the other role is needed for."""
    return ROLES.index(role) >= ROLES.index(least)


@dataclass(frozen=True)
class Clinician:
    """Somebody at the desk of one organisation (tenant)."""

    id: str
    tenant_id: str
    organisation: str
    name: str
    email: str
    role: Role
    created_at: datetime
    disabled_at: datetime | None
    has_password: bool

    @property
    def actor(self) -> Actor:
        """As the one who acts."""
        return Actor("clinician", self.id, self.tenant_id)


@dataclass(frozen=True)
class ClinicianSession:
    """A signed-in browser. token is known only while it is presented."""

    id: str
    token: str
    clinician: Clinician
    how: How
    device: str
    created_at: datetime
    seen_at: datetime
    expires_at: datetime

    @property
    def actor(self) -> Actor:
        """The one who acts in this session."""
        return self.clinician.actor


@dataclass(frozen=True)
class Invitation:
    """An open link that makes an account. organisation: empty when whoever takes it names it.

    email: of the account that gets new ways to sign in; empty when an account is made.
    """

    id: str
    organisation: str
    role: Role
    email: str
    created_at: datetime
    expires_at: datetime

    @property
    def is_first(self) -> bool:
        """Whether it makes the very first account."""
        return not self.organisation


@dataclass(frozen=True)
class Offered:
    """A link as it is shown, this once."""

    id: str
    token: str
    expires_at: datetime


@dataclass(frozen=True)
class Joining:
    """What somebody says when an account is made. organisation: asked of the very first clinician alone."""

    name: str
    email: str
    organisation: str = ""


@dataclass(frozen=True)
class Vouched:
    """Whom an organisation's own login means (subject), and the address it vouches for, if any."""

    issuer: str
    subject: str
    email: str


@dataclass(frozen=True)
class NewPasskey:
    """The public half of a passkey that a browser has just made. device: how the browser names itself."""

    credential_id: bytes
    public_key: bytes
    sign_count: int
    device: str


@dataclass(frozen=True)
class Passkey:
    """A passkey of somebody's account."""

    id: str
    clinician_id: str
    credential_id: bytes
    public_key: bytes
    sign_count: int
    device: str
    created_at: datetime
    last_used_at: datetime | None


@dataclass(frozen=True)
class FamilyInvitation:
    """A family that was asked for a scan, and how far it has come. tries: wrong dates of birth so far.

    case_status: of the case the family opened, None before; is_locked: too many wrong dates of birth.
    """

    id: str
    tenant_id: str
    organisation: str
    external_id: str | None
    asks_birth_date: bool
    is_locked: bool
    created_at: datetime
    expires_at: datetime
    taken_at: datetime | None
    case_id: str | None
    case_status: Status | None
