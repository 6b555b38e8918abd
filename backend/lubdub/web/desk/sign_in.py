"""Signing in and out at the desk."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from lubdub.cases.desk_values import Clinician, How
from lubdub.cases.errors import SignInRefused, TooManyTries
from lubdub.web.deps import (
    ClinicianDep,
    DeskGuard,
    KnownClinicianDep,
    ServicesDep,
    StaffDep,
    VisitorDep,
    VisitorGuard,
    is_fresh,
    known_clinician,
)
from lubdub.web.desk.common import HOME, SIGN_IN, device_of
from lubdub.web.guard import Visitor, desk_cookie, new_visitor, own_path
from lubdub.web.pages.common import FormDep, as_typed, go, said
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.problems import note_problem
from lubdub.web.services import Services

CLEARED = {"Clear-Site-Data": '"storage"'}
"""Tells the browser to forget what pages kept. The pages themselves are kept by nobody; a family's cookie stays."""

router = APIRouter(include_in_schema=False)


@router.get(SIGN_IN)
def sign_in(
    request: Request, browser: VisitorDep, known: KnownClinicianDep, back: str = HOME, again: bool = False
) -> Response:
    """The ways in; for somebody who is in already, on to where they wanted.

    again: unless they want what needs to have signed in just now.
    """
    is_again = again and known is not None and not is_fresh(known)
    if known is not None and not is_again:
        return go(own_path(back, HOME))
    return sign_in_page(request, browser, back, {}, "", is_again)


@router.post(SIGN_IN, dependencies=[VisitorGuard])
def signed_in(request: Request, browser: VisitorDep, form: FormDep, held: ServicesDep) -> Response:
    """Password and code together. Which of the three does not fit is not said."""
    _ = gettext_of(request)
    email, back = said(form, "email"), said(form, "back")
    address = request.client.host if request.client else ""
    try:
        who, how = held.staff.credentials.sign_in(email, as_typed(form, "password"), said(form, "code"), address)
    except SignInRefused:
        note_problem("not-signed-in")
        wrong = _("E-mail, password and code do not fit together. Try again with the next code of your app.")
        return sign_in_page(request, browser, back, {"email": wrong}, email)
    except TooManyTries:
        note_problem("too-many-requests")
        return sign_in_page(
            request, browser, back, {"email": _("Too many tries. Wait 15 minutes, then try again.")}, email
        )
    open_session(request, held, who, how)
    return go(own_path(back, HOME))


@router.post("/desk/sign-out", dependencies=[DeskGuard])
def sign_out(request: Request, session: ClinicianDep, staff: StaffDep, held: ServicesDep) -> Response:
    """The session is over at once, here and on the server."""
    staff.sessions.end(session.clinician, session.id)
    request.state.set_cookie = desk_cookie(held.settings, new_visitor())
    return RedirectResponse(SIGN_IN, 303, CLEARED)


def open_session(request: Request, held: Services, who: Clinician, how: How) -> None:
    """Sign this browser in, under a new cookie. What it was signed in with before is over."""
    before = known_clinician(request, held)
    if before is not None:
        held.staff.sessions.end(before.clinician, before.id)
    session = held.staff.sessions.open(who, how, device_of(request))
    request.state.set_cookie = desk_cookie(held.settings, session)


def sign_in_page(
    request: Request, browser: Visitor, back: str, errors: dict[str, str], email: str, is_again: bool = False
) -> Response:
    """The ways in, and what went wrong with one. back: where one wanted."""
    held: Services = request.app.state.services
    facts = {
        "errors": errors,
        "email": email,
        "is_again": is_again,
        "goes_to": own_path(back, HOME),
        "login": (held.settings.oidc_name or held.settings.oidc_issuer) if held.settings.oidc_issuer else "",
    }
    return render(request, "clinician/sign_in/sign_in.html", browser, 422 if errors else 200, **facts)
