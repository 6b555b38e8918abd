"""Passkeys at the desk: signing in with one, making an account with one, and those of one's account. For scripts."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel, Field

from lubdub.cases.desk_values import Joining
from lubdub.cases.errors import EmailTaken, LinkSpent
from lubdub.web.deps import DeskGuard, FreshClinicianDep, ServicesDep, StaffDep, VisitorDep, VisitorGuard
from lubdub.web.desk.account import ACCOUNT
from lubdub.web.desk.common import HOME, SIGN_IN, device_of
from lubdub.web.desk.join import JOIN, account_faults, email_taken, link_spent
from lubdub.web.desk.sign_in import open_session
from lubdub.web.guard import own_path
from lubdub.web.pages.common import FormDep, go, said
from lubdub.web.passkey_ceremony import Ceremony

router = APIRouter(include_in_schema=False)

Word = Annotated[str, Field(max_length=300)]


class Using(BaseModel):
    """A passkey is used. credential: as the browser gives it."""

    credential: dict[str, Any] = {}
    back: Word = HOME


class Making(BaseModel):
    """An account is made with a passkey."""

    link: Word = ""
    name: Word = ""
    email: Word = ""
    organisation: Word = ""
    credential: dict[str, Any] = {}


def _ceremony(held: ServicesDep) -> Ceremony:
    return Ceremony(held.settings, held.staff.passkeys)


CeremonyDep = Annotated[Ceremony, Depends(_ceremony)]


@router.post(f"{SIGN_IN}/passkey/options", dependencies=[VisitorGuard])
def ask_to_use(browser: VisitorDep, ceremony: CeremonyDep) -> dict[str, Any]:
    """What the browser is to sign."""
    return ceremony.ask_to_use(browser.token)


@router.post(f"{SIGN_IN}/passkey", dependencies=[VisitorGuard])
def use(request: Request, told: Using, browser: VisitorDep, ceremony: CeremonyDep, held: ServicesDep) -> Response:
    """Signs in with a passkey."""
    open_session(request, held, ceremony.used(browser.token, told.credential), "passkey")
    return JSONResponse({"next": own_path(told.back, HOME)})


@router.post(f"{JOIN}/passkey/options", dependencies=[VisitorGuard])
def ask_to_join(
    request: Request, told: Making, browser: VisitorDep, ceremony: CeremonyDep, staff: StaffDep
) -> Response:
    """What the browser needs to make the new account's passkey; or what is missing from the form."""
    faults = _faults(request, told, staff)
    if faults:
        return JSONResponse({"errors": faults}, 422)
    return JSONResponse(ceremony.ask_to_make(browser.token, told.email))


@router.post(f"{JOIN}/passkey", dependencies=[VisitorGuard])
def join(
    request: Request, told: Making, browser: VisitorDep, ceremony: CeremonyDep, held: ServicesDep, staff: StaffDep
) -> Response:
    """Makes the account with its passkey, uses the link up, and signs in."""
    faults = _faults(request, told, staff)
    if faults:
        return JSONResponse({"errors": faults}, 422)
    new = ceremony.made(browser.token, told.credential, device_of(request))
    joining = Joining(told.name, told.email, told.organisation)
    try:
        who = staff.invitations.accept(told.link, joining, staff.passkeys.equipped(new))
    except LinkSpent:
        return JSONResponse({"errors": {"link": link_spent(request)}}, 422)
    except EmailTaken:
        return JSONResponse({"errors": {"email": email_taken(request)}}, 422)
    open_session(request, held, who, "passkey")
    return JSONResponse({"next": HOME})


@router.post(f"{ACCOUNT}/passkeys/options", dependencies=[DeskGuard])
def ask_to_add(session: FreshClinicianDep, ceremony: CeremonyDep) -> dict[str, Any]:
    """What the browser needs to make one more passkey."""
    return ceremony.ask_to_make(session.token, session.clinician.email, session.clinician)


@router.post(f"{ACCOUNT}/passkeys", dependencies=[DeskGuard])
def add(request: Request, told: Using, session: FreshClinicianDep, ceremony: CeremonyDep, staff: StaffDep) -> Response:
    """Adds it to the account."""
    new = ceremony.made(session.token, told.credential, device_of(request))
    staff.passkeys.add(session.clinician, new)
    return JSONResponse({"next": ACCOUNT})


@router.post(f"{ACCOUNT}/passkeys/remove", dependencies=[DeskGuard])
def remove(session: FreshClinicianDep, form: FormDep, staff: StaffDep) -> Response:
    """Forgets a passkey, for instance of a lost phone."""
    staff.passkeys.remove(session.clinician, said(form, "passkey"))
    return go(ACCOUNT)


def _faults(request: Request, told: Making, staff: StaffDep) -> dict[str, str]:
    invitation = staff.invitations.look(told.link)
    if invitation is None:
        return {"link": link_spent(request)}
    return account_faults(request, invitation, told.model_dump(exclude={"credential"}))
