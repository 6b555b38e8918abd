"""Reading the audit trail: the lines that concern one organisation, and whether the whole chain is unbroken."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.models import AuditRow, CaseRow, PortalKeyRow
from lubdub.cases.models_desk import ClinicianRow
from lubdub.cases.values import Actor

ID_LENGTH = 16
"""Of keys' and clinicians' ids, with which the detail of what the system did about them begins."""
AT_ONCE = 1000


@dataclass(frozen=True)
class Line:
    """One line of the trail. actor: kind and id; who: the name behind it, empty for families and the system."""

    sequence: int
    at: datetime
    actor: str
    who: str
    action: str
    case_id: str | None
    detail: str
    previous_sha256: str
    sha256: str

    def to_json(self) -> dict[str, str | int | None]:
        """As it is exported; names of people stay out of it."""
        return {
            "sequence": self.sequence,
            "at": self.at.isoformat(),
            "actor": self.actor,
            "action": self.action,
            "case_id": self.case_id,
            "detail": self.detail,
            "previous_sha256": self.previous_sha256,
            "sha256": self.sha256,
        }


class Trail:
    """What was done about an organisation's cases, and by its people and portals."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def page(self, actor: Actor, before: int | None = None, case_id: str = "", limit: int = 100) -> list[Line]:
        """Lines of the actor's organisation, newest first. before: a line's number; case_id: the beginning of one."""
        query = _of(actor.tenant_id).order_by(AuditRow.sequence.desc()).limit(limit)
        if before is not None:
            query = query.where(AuditRow.sequence < before)
        if case_id:
            query = query.where(AuditRow.case_id.startswith(case_id, autoescape=True))
        return list(self._lines(actor, query))

    def export(self, actor: Actor) -> Iterator[Line]:
        """All lines of the actor's organisation, oldest first; that they were taken out is a line itself."""
        with self._database.writing() as session:
            audit.append(self._database, session, actor, "audit.export", None, now())
        yield from self._lines(actor, _of(actor.tenant_id).order_by(AuditRow.sequence))

    def first_broken_line(self) -> int | None:
        """The first line of the whole chain that does not fit, or None."""
        return audit.first_broken_line(self._database)

    def _lines(self, actor: Actor, query: sa.Select[AuditRow]) -> Iterator[Line]:
        with self._database.reading() as session:
            people = sa.select(ClinicianRow.id, ClinicianRow.name).where(ClinicianRow.tenant_id == actor.tenant_id)
            portals = sa.select(PortalKeyRow.id, PortalKeyRow.name).where(PortalKeyRow.tenant_id == actor.tenant_id)
            names = {f"clinician:{id_}": name for id_, name in session.execute(people)}
            names |= {f"key:{id_}": name for id_, name in session.execute(portals)}
            for row in session.scalars(query).yield_per(AT_ONCE):
                yield Line(
                    sequence=row.sequence,
                    at=row.at,
                    actor=row.actor,
                    who=names.get(row.actor, ""),
                    action=row.action,
                    case_id=row.case_id,
                    detail=row.detail,
                    previous_sha256=row.previous_sha256,
                    sha256=row.sha256,
                )


def _of(tenant_id: str) -> sa.Select[AuditRow]:
    """About its cases; by its people and portals; and what was done about these from outside."""
    cases = sa.select(CaseRow.id).where(CaseRow.tenant_id == tenant_id)
    people = sa.select(ClinicianRow.id).where(ClinicianRow.tenant_id == tenant_id)
    portals = sa.select(PortalKeyRow.id).where(PortalKeyRow.tenant_id == tenant_id)
    by_person = sa.select(sa.literal("clinician:") + ClinicianRow.id).where(ClinicianRow.tenant_id == tenant_id)
    by_portal = sa.select(sa.literal("key:") + PortalKeyRow.id).where(PortalKeyRow.tenant_id == tenant_id)
    about = sa.func.substr(AuditRow.detail, 1, ID_LENGTH)
    from_outside = AuditRow.case_id.is_(None) & (about.in_(people) | about.in_(portals))
    return sa.select(AuditRow).where(
        AuditRow.case_id.in_(cases) | AuditRow.actor.in_(by_person) | AuditRow.actor.in_(by_portal) | from_outside
    )
