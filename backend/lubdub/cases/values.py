"""The frozen values this room hands out; rows of the database never leave it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from lubdub.cases.states import JobKind, Status

Answer = Literal["no", "yes", "unsure"]
StopQuestion = Literal["heart_on_right", "chest_operation_or_device", "late_pregnancy"]


@dataclass(frozen=True)
class Actor:
    """Who asks. kind `key` is a portal (id: its key), `family` a browser session, `system` Lubdub itself.

    A portal sees every case of its tenant; a family only those its own session opened.
    """

    kind: Literal["key", "family", "system"]
    id: str
    tenant_id: str

    @property
    def name(self) -> str:
        """As written in the audit trail."""
        return f"{self.kind}:{self.id}"


SYSTEM = Actor("system", "lubdub", "")


@dataclass(frozen=True)
class NewCase:
    """What is said when a case is opened. age_years: 0 to 120, fractions for babies."""

    age_years: float
    sex: Literal["female", "male"]
    posture: Literal["supine", "sitting"]
    answers: Mapping[StopQuestion, Answer] = field(default_factory=dict)
    external_id: str | None = None


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


@dataclass(frozen=True)
class Job:
    """One piece of work on a case. The id is unique for ever: a repeated check gets a new one."""

    id: str
    case_id: str
    kind: JobKind


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
    """A portal's key as listed; the token itself is shown once and never stored."""

    id: str
    tenant_id: str
    name: str
    prefix: str
    scopes: tuple[str, ...]
    created_at: datetime
    last_used_at: datetime | None
    revoked_at: datetime | None


@dataclass(frozen=True)
class FamilySession:
    """A browser that opened cases without an account. token is known only while it is presented."""

    id: str
    token: str
    expires_at: datetime

    @property
    def actor(self) -> Actor:
        """The one who acts in this session."""
        return Actor("family", self.id, FAMILIES)


FAMILIES = "families"
"""The tenant of everybody who comes without a portal."""
