"""The frozen values this room hands out; rows of the database never leave it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from lubdub.cases.states import JobKind, Status

Answer = Literal["no", "yes", "unsure"]
StopQuestion = Literal["heart_on_right", "chest_operation_or_device", "late_pregnancy"]
Person = Literal["child", "self", "other", "sample"]
"""Who lies on the scan, seen from whoever has the pages before them; a sample is a made-up body."""


@dataclass(frozen=True)
class Actor:
    """Who asks. kind `key` is a portal (id: its key), `clinician` somebody at the desk, `family` a browser session,
    `system` Lubdub itself.

    Portals and clinicians see every case of their tenant; a family only those of its own session. In a sandbox nobody
    is real.
    """

    kind: Literal["key", "clinician", "family", "system"]
    id: str
    tenant_id: str
    is_sandbox: bool = False

    @property
    def name(self) -> str:
        """As written in the audit trail."""
        return f"{self.kind}:{self.id}"


SYSTEM = Actor("system", "lubdub", "")


@dataclass(frozen=True)
class Consent:
    """A yes to taking and keeping a scan. version: of the words agreed to; language: they were read in.

    child: what the child said when asked: `agreed`, `too_young` to be asked, or None when there is no child.
    """

    version: str
    language: str
    given_at: datetime
    child: Literal["agreed", "too_young"] | None = None

    def to_json(self) -> dict[str, str | None]:
        """As it is kept."""
        return {
            "version": self.version,
            "language": self.language,
            "given_at": self.given_at.isoformat(),
            "child": self.child,
        }


@dataclass(frozen=True)
class NewCase:
    """What is said when a case is opened. age_years: 0 to 120, fractions for babies.

    consent: a family's case cannot be opened without it, but for a made-up sample; portals keep their own.
    """

    age_years: float
    sex: Literal["female", "male"]
    posture: Literal["supine", "sitting"]
    answers: Mapping[StopQuestion, Answer] = field(default_factory=dict)
    external_id: str | None = None
    person: Person = "child"
    consent: Consent | None = None


@dataclass(frozen=True)
class Guide:
    """How far the family has come with the instructions for making a scan. app: the one chosen, or None."""

    app: str | None = None
    is_read: bool = False


@dataclass(frozen=True)
class Case:
    """One case as it stands. landmarks: name -> [x, y, z] in the file's own coordinates and unit."""

    id: str
    tenant_id: str
    owner_session_id: str | None
    external_id: str | None
    status: Status
    age_years: float | None
    sex: Literal["female", "male"] | None
    posture: Literal["supine", "sitting"]
    answers: Mapping[StopQuestion, Answer]
    unit: str | None
    method: Literal["lubdub", "paper", "rule"]
    landmarks: Mapping[str, list[float]] | None
    job_id: str | None
    stage: str | None
    fraction: float
    reason: Mapping[str, str] | None
    created_at: datetime
    updated_at: datetime
    has_scan: bool
    is_checked: bool
    person: Person = "child"
    consent: Mapping[str, str | None] | None = None
    guide: Guide = field(default_factory=Guide)
    is_sent: bool = False
    is_shared: bool = False
    is_held: bool = False


@dataclass(frozen=True)
class Job:
    """One piece of work on a case. The id is unique for ever: a repeated check gets a new one.

    turn: when it goes, see `turns`; of no account once it was handed to a worker.
    """

    id: str
    case_id: str
    kind: JobKind
    turn: int = field(default=1, compare=False)


@dataclass(frozen=True)
class CaseEvent:
    """One line of a case's story. sequence: 1, 2, 3 ... within the case."""

    sequence: int
    kind: Literal["status", "progress"]
    data: Mapping[str, Any]


@dataclass(frozen=True)
class Receipt:
    """Proof of a deletion: sha256 is the audit line's hash, which nobody can write afterwards."""

    id: str
    deleted_at: datetime
    sha256: str


@dataclass(frozen=True)
class PortalKey:
    """A portal's key as listed; the token itself is shown once and never stored.

    expires_at: when a key that was rotated stops working, None when it was not.
    """

    id: str
    tenant_id: str
    name: str
    prefix: str
    scopes: tuple[str, ...]
    created_at: datetime
    last_used_at: datetime | None
    revoked_at: datetime | None
    expires_at: datetime | None = None
    is_sandbox: bool = False

    @property
    def actor(self) -> Actor:
        """The portal that acts with this key."""
        return Actor("key", self.id, self.tenant_id, self.is_sandbox)


@dataclass(frozen=True)
class FamilySession:
    """A browser that has cases without an account. token is known only while it is presented.

    An embedded one lives in a frame of a portal's page, on one of the origins.
    """

    id: str
    token: str
    expires_at: datetime
    origins: tuple[str, ...] = ()
    is_embedded: bool = False
    is_sandbox: bool = False

    @property
    def actor(self) -> Actor:
        """The one who acts in this session."""
        return Actor("family", self.id, FAMILIES, self.is_sandbox)


FAMILIES = "families"
"""The tenant of everybody who comes without a portal."""
