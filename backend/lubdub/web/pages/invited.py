"""A family arrives by a clinician's link: the link is used up by a button, after a date of birth where one is asked."""

from __future__ import annotations

from datetime import date

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.errors import LinkSpent, WrongBirthDate
from lubdub.web.deps import DraftsDep, FamilyDep, FormGuard, StaffDep
from lubdub.web.pages.common import FormDep, go, said
from lubdub.web.pages.look import gettext_of, render

INVITED = "/invited"
OF_CONSENT = ("consent", "consent_language", "consent_at")

router = APIRouter(include_in_schema=False)


@router.get(INVITED)
def arrived(request: Request, family: FamilyDep) -> Response:
    """Where the link leads. The code is in the part of the address that browsers do not send."""
    return _page(request, family, "", {})


@router.post(INVITED, dependencies=[FormGuard])
def taken(request: Request, family: FamilyDep, form: FormDep, staff: StaffDep, drafts: DraftsDep) -> Response:
    """Takes the link for this browser. Only this button does: programs that follow links change nothing."""
    _ = gettext_of(request)
    code = said(form, "code")
    link = staff.families.look(code)
    spent = _("This link does not work any more. Ask whoever sent it for a new one.")
    if link is None:
        return _page(request, family, code, {"code": spent})
    if link.asks_birth_date and form.get("birth_date") is None:
        return _birth_date_page(request, family, code, {})
    try:
        link = staff.families.take(family.actor, code, _date(said(form, "birth_date")))
    except LinkSpent:
        return _page(request, family, code, {"code": spent})
    except WrongBirthDate as wrong:
        if wrong.left <= 0:
            return _page(request, family, "", {"code": spent})
        fault = _("This is not the date that we were told. Please look again.")
        return _birth_date_page(request, family, code, {"birth_date": fault})
    answers = drafts.read(family)
    if answers:  # what was agreed to before was said without knowing who asks
        drafts.write(family, {name: said for name, said in answers.items() if name not in OF_CONSENT})
    return go("/" if link.case_id is None else f"/cases/{link.case_id}")


def _date(text: str) -> date | None:
    try:
        return date.fromisoformat(text)
    except ValueError:
        return None


def _page(request: Request, family: FamilyDep, code: str, errors: dict[str, str]) -> Response:
    return render(request, "family/invited/invited.html", family, 422 if errors else 200, code=code, errors=errors)


def _birth_date_page(request: Request, family: FamilyDep, code: str, errors: dict[str, str]) -> Response:
    return render(request, "family/invited/birth_date.html", family, 422 if errors else 200, code=code, errors=errors)
