"""Families that were asked for a scan: a link with picture code and text to send, and how far each has come."""

from __future__ import annotations

from datetime import date
from typing import Any

from babel.dates import format_date
from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.clock import now
from lubdub.cases.desk_values import ClinicianSession, FamilyInvitation, Offered
from lubdub.web.deps import ClinicianDep, DeskGuard, ServicesDep, StaffDep
from lubdub.web.desk.codes import qr_svg
from lubdub.web.desk.common import show
from lubdub.web.desk.families_words import state_words, text_to_send
from lubdub.web.languages import language_of, languages
from lubdub.web.pages.common import FormDep, go, said
from lubdub.web.pages.invited import INVITED
from lubdub.web.pages.look import gettext_of
from lubdub.web.services import Services

FAMILIES_PAGE = "/desk/families"
LONGEST_REFERENCE = 200

router = APIRouter(include_in_schema=False)


@router.get(FAMILIES_PAGE)
def families(request: Request, session: ClinicianDep, held: ServicesDep) -> Response:
    """Everybody who was asked, the latest first, and a form to ask another family."""
    return _page(request, session, held, {})


@router.post(f"{FAMILIES_PAGE}/invite", dependencies=[DeskGuard])
def invite(request: Request, session: ClinicianDep, form: FormDep, held: ServicesDep) -> Response:
    """A link for a family, shown this once."""
    _ = gettext_of(request)
    reference, birth = said(form, "reference"), said(form, "birth_date")
    errors = {}
    if len(reference) > LONGEST_REFERENCE:
        errors["reference"] = _("At most 200 signs.")
    birth_date = _past_date(birth)
    if birth and birth_date is None:
        errors["birth_date"] = _("Type a date in the past, or leave it empty.")
    if errors:
        return _page(request, session, held, errors)
    offered = held.staff.families.offer(session.actor, reference, birth_date)
    return _link_page(request, session, held, offered, said(form, "language"))


@router.post(f"{FAMILIES_PAGE}/again", dependencies=[DeskGuard])
def invite_again(request: Request, session: ClinicianDep, form: FormDep, held: ServicesDep) -> Response:
    """A new link in place of the old one, with words that fit how far the family has come."""
    offered = held.staff.families.offer_again(session.actor, said(form, "invitation"))
    return _link_page(request, session, held, offered, said(form, "language"))


@router.post(f"{FAMILIES_PAGE}/uninvite", dependencies=[DeskGuard])
def uninvite(session: ClinicianDep, form: FormDep, staff: StaffDep) -> Response:
    """The link stops working; a case that was opened stays."""
    staff.families.revoke(session.actor, said(form, "invitation"))
    return go(FAMILIES_PAGE)


def _past_date(text: str) -> date | None:
    try:
        given = date.fromisoformat(text)
    except ValueError:
        return None
    return given if given <= now().date() else None


def _page(request: Request, session: ClinicianSession, held: Services, errors: dict[str, str]) -> Response:
    rows = [_in_words(request, one) for one in held.staff.families.list_all(session.actor)]
    facts: dict[str, Any] = {"errors": errors, "asked": rows, "last_day": now().date().isoformat()}
    return show(request, "clinician/families/families.html", session, 422 if errors else 200, **facts)


def _in_words(request: Request, one: FamilyInvitation) -> dict[str, Any]:
    day = format_date(one.created_at, locale=language_of(request))
    return {"id": one.id, "reference": one.external_id, "day": day, "state": state_words(gettext_of(request), one)}


def _link_page(
    request: Request, session: ClinicianSession, held: Services, offered: Offered, language: str
) -> Response:
    asked = held.staff.families.get(session.actor, offered.id)
    language = language if language in languages() else language_of(request)
    address = f"{held.settings.address}{INVITED}#{offered.token}"
    facts: dict[str, Any] = {
        "address": address,
        "picture": qr_svg(address),
        "text": text_to_send(language, asked, address),
        "text_language": language,
        "reference": asked.external_id,
        "back": FAMILIES_PAGE,
    }
    return show(request, "clinician/families/link.html", session, **facts)
