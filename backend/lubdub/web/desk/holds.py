"""Legal holds, for leads: cases that may not be deleted for now, and why."""

from __future__ import annotations

from collections.abc import Mapping

from babel.dates import format_date
from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.desk_values import ClinicianSession
from lubdub.cases.errors import CaseNotFound, StateConflict
from lubdub.cases.holds import LONGEST_REASON, Hold
from lubdub.cases.staff import Staff
from lubdub.web.deps import DeskGuard, LeadDep, StaffDep
from lubdub.web.desk.common import show
from lubdub.web.languages import language_of
from lubdub.web.pages.common import FormDep, go, said
from lubdub.web.pages.look import gettext_of

HOLDS = "/desk/holds"

router = APIRouter(include_in_schema=False)


@router.get(HOLDS)
def holds(request: Request, session: LeadDep, staff: StaffDep) -> Response:
    """What is held now, and a form to hold another case."""
    return _page(request, session, staff, {}, {})


@router.post(f"{HOLDS}/place", dependencies=[DeskGuard])
def place(request: Request, session: LeadDep, form: FormDep, staff: StaffDep) -> Response:
    """Hold a case."""
    typed = {name: " ".join(said(form, name).split()) for name in ("case", "reason")}
    _ = gettext_of(request)
    errors = {}
    if not 0 < len(typed["reason"]) <= LONGEST_REASON:
        errors["reason"] = _("Say why, in at most 200 signs.")
    else:
        try:
            staff.holds.place(session.actor, typed["case"], typed["reason"])
        except CaseNotFound:
            errors["case"] = _("There is no such case, or it is not yours.")
        except StateConflict:
            errors["case"] = _("This case is held already.")
    return _page(request, session, staff, errors, typed) if errors else go(HOLDS)


@router.post(f"{HOLDS}/lift", dependencies=[DeskGuard])
def lift(request: Request, session: LeadDep, form: FormDep, staff: StaffDep) -> Response:
    """Let a case go its way again."""
    reason = said(form, "reason").strip()
    _ = gettext_of(request)
    if not 0 < len(reason) <= LONGEST_REASON:
        return _page(request, session, staff, {"reason": _("Say why, in at most 200 signs.")}, {})
    staff.holds.lift(session.actor, said(form, "case"), reason)
    return go(HOLDS)


def _page(
    request: Request, session: ClinicianSession, staff: Staff, errors: Mapping[str, str], typed: Mapping[str, str]
) -> Response:
    shown = [_shown(hold, language_of(request)) for hold in staff.holds.list_all(session.actor)]
    status = 422 if errors else 200
    typed = {"case": "", "reason": ""} | dict(typed)
    return show(request, "clinician/holds/holds.html", session, status, holds=shown, errors=errors, typed=typed)


def _shown(hold: Hold, language: str) -> dict[str, str]:
    return {
        "case_id": hold.case_id,
        "day": format_date(hold.since, "medium", locale=language),
        "reason": hold.reason,
    }
