"""The audit trail, for leads: who saw, changed, exported, signed and deleted what and when; nothing clinical."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response, StreamingResponse

from lubdub.cases.trail import Line
from lubdub.web.deps import LeadDep, StaffDep
from lubdub.web.desk.audit_words import action_words
from lubdub.web.desk.common import show
from lubdub.web.pages.look import gettext_of

AUDIT = "/desk/audit"
LINES = 100
COLUMNS = ("sequence", "at", "actor", "action", "case_id", "detail", "previous_sha256", "sha256")

router = APIRouter(include_in_schema=False)

Before = Annotated[int | None, Query(ge=1, le=2**31)]
CaseStart = Annotated[str, Query(alias="case", max_length=64)]


@router.get(AUDIT)
def trail(
    request: Request,
    session: LeadDep,
    staff: StaffDep,
    before: Before = None,
    case: CaseStart = "",
    check: bool = False,
) -> Response:
    """A page of lines, newest first; with check, whether the whole chain is unbroken."""
    lines = staff.trail.page(session.actor, before, case.strip(), LINES)
    facts: dict[str, Any] = {
        "lines": lines,
        "done": action_words(gettext_of(request)),
        "searched": case,
        "next": lines[-1].sequence if len(lines) == LINES else None,
        "is_checked": check,
        "broken": staff.trail.first_broken_line() if check else None,
    }
    return show(request, "clinician/audit/audit.html", session, **facts)


@router.get(f"{AUDIT}.csv")
def as_csv(session: LeadDep, staff: StaffDep) -> StreamingResponse:
    """Every line of the organisation, for a spreadsheet."""
    return StreamingResponse(
        _csv(staff.trail.export(session.actor)), media_type="text/csv; charset=utf-8", headers=_named("audit.csv")
    )


@router.get(f"{AUDIT}.json")
def as_json(session: LeadDep, staff: StaffDep) -> Response:
    """Every line of the organisation, and whether the whole chain is unbroken."""
    lines = [line.to_json() for line in staff.trail.export(session.actor)]
    document = {"first_broken_line": staff.trail.first_broken_line(), "lines": lines}
    return Response(json.dumps(document), media_type="application/json", headers=_named("audit.json"))


def _csv(lines: Iterator[Line]) -> Iterator[str]:
    yield ",".join(COLUMNS) + "\r\n"
    for line in lines:
        written = io.StringIO()
        csv.writer(written).writerow(line.to_json()[column] for column in COLUMNS)
        yield written.getvalue()


def _named(name: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="lubdub-{name}"'}
