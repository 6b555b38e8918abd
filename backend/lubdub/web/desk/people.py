"""Who works here: an administrator invites colleagues, changes roles, and shuts accounts."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.desk_values import ROLES, ClinicianSession, Role
from lubdub.web.deps import AdministratorDep, DeskGuard, FreshSignIn, ServicesDep, StaffDep
from lubdub.web.desk.common import role_words, show
from lubdub.web.desk.join import JOIN
from lubdub.web.pages.common import FormDep, go, said
from lubdub.web.problems import Problem
from lubdub.web.services import Services

PEOPLE = "/desk/people"

router = APIRouter(include_in_schema=False)


@router.get(PEOPLE)
def people(request: Request, session: AdministratorDep, held: ServicesDep) -> Response:
    """Everybody of the organisation, and the links that are still open."""
    return _page(request, session, held)


@router.post(f"{PEOPLE}/invite", dependencies=[DeskGuard, FreshSignIn])
def invite(request: Request, session: AdministratorDep, form: FormDep, held: ServicesDep) -> Response:
    """A link for a colleague, shown this once."""
    offered = held.staff.invitations.offer(session.actor, _role(said(form, "role")))
    return _page(request, session, held, link=f"{held.settings.desk_address}{JOIN}#{offered.token}")


@router.post(f"{PEOPLE}/uninvite", dependencies=[DeskGuard])
def uninvite(session: AdministratorDep, form: FormDep, staff: StaffDep) -> Response:
    """The link stops working."""
    staff.invitations.revoke(session.actor, said(form, "invitation"))
    return go(PEOPLE)


@router.post(f"{PEOPLE}/renew", dependencies=[DeskGuard, FreshSignIn])
def renew(request: Request, session: AdministratorDep, form: FormDep, held: ServicesDep) -> Response:
    """A link by which a colleague gets new ways to sign in, shown this once."""
    offered = held.staff.invitations.offer_renewal(session.actor, said(form, "clinician"))
    return _page(request, session, held, link=f"{held.settings.desk_address}{JOIN}#{offered.token}")


@router.post(f"{PEOPLE}/role", dependencies=[DeskGuard])
def change_role(session: AdministratorDep, form: FormDep, staff: StaffDep) -> Response:
    """Another role for somebody."""
    staff.clinicians.change_role(session.actor, said(form, "clinician"), _role(said(form, "role")))
    return go(PEOPLE)


@router.post(f"{PEOPLE}/disable", dependencies=[DeskGuard])
def disable(session: AdministratorDep, form: FormDep, staff: StaffDep) -> Response:
    """Somebody is shut out at once."""
    staff.clinicians.disable(session.actor, said(form, "clinician"))
    return go(PEOPLE)


@router.post(f"{PEOPLE}/enable", dependencies=[DeskGuard])
def enable(session: AdministratorDep, form: FormDep, staff: StaffDep) -> Response:
    """Somebody is let in again."""
    staff.clinicians.enable(session.actor, said(form, "clinician"))
    return go(PEOPLE)


def _role(word: str) -> Role:
    role = next((role for role in ROLES if role == word), None)
    if role is None:
        raise Problem("bad-request", "There is no such role.")
    return role


def _page(request: Request, session: ClinicianSession, held: Services, link: str = "") -> Response:
    tenant_id = session.clinician.tenant_id
    facts: dict[str, Any] = {
        "people": held.staff.clinicians.list_all(tenant_id),
        "open_links": held.staff.invitations.list_open(tenant_id),
        "roles": role_words(request),
        "link": link,
    }
    return show(request, "clinician/people/people.html", session, **facts)
