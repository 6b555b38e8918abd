"""The link that makes an account: opened by a button, used up only when the account is there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response
from starlette.datastructures import FormData

from lubdub.cases.clinicians import is_email
from lubdub.cases.credentials import fits, is_secret, new_recovery_codes, new_secret
from lubdub.cases.desk_values import Invitation, Joining
from lubdub.cases.errors import EmailTaken, LinkSpent
from lubdub.cases.passwords import fault_of
from lubdub.web.deps import ServicesDep, StaffDep, VisitorDep, VisitorGuard
from lubdub.web.desk.codes import code_picture
from lubdub.web.desk.common import role_words
from lubdub.web.desk.sign_in import open_session
from lubdub.web.guard import Visitor
from lubdub.web.pages.common import FormDep, as_typed, said
from lubdub.web.pages.look import gettext_of, render

JOIN = "/desk/join"

router = APIRouter(include_in_schema=False)


@router.get(JOIN)
def arrived(request: Request, browser: VisitorDep) -> Response:
    """Where the link leads. Its secret is in the part of the address that browsers do not send."""
    return _arrived(request, browser, {})


@router.post(JOIN, dependencies=[VisitorGuard])
def opened(request: Request, browser: VisitorDep, form: FormDep, staff: StaffDep, held: ServicesDep) -> Response:
    """Into which organisation, in which role; and what is needed for an account. The link still works after this."""
    link = said(form, "link")
    invitation = staff.invitations.look(link)
    if invitation is None:
        return _arrived(request, browser, {"link": link_spent(request)})
    clinic = held.settings.clinic_name
    return _account(request, browser, invitation, {"link": link, "organisation": clinic, "secret": new_secret()}, {})


@router.post(f"{JOIN}/password", dependencies=[VisitorGuard])
def joined(request: Request, browser: VisitorDep, form: FormDep, held: ServicesDep) -> Response:
    """Makes the account with a password and a code app, uses the link up, and signs in."""
    invitations, credentials = held.staff.invitations, held.staff.credentials
    typed = {name: said(form, name) for name in ("link", "name", "email", "organisation", "secret")}
    invitation = invitations.look(typed["link"])
    if invitation is None or not is_secret(typed["secret"]):
        return _arrived(request, browser, {"link": link_spent(request)})
    known = held.staff.clinicians.find(invitation.email)
    own = [typed["name"], typed["email"], typed["organisation"], invitation.organisation]
    if known is not None:
        own += [known.name, known.email]
    errors = account_faults(request, invitation, typed) | password_faults(request, form, own)
    if errors:
        return _account(request, browser, invitation, typed, errors)
    codes = new_recovery_codes()
    equip = credentials.equipped(as_typed(form, "password"), typed["secret"], codes)
    joining = Joining(typed["name"], typed["email"], typed["organisation"])
    try:
        who = invitations.accept(typed["link"], joining, equip)
    except LinkSpent:
        return _arrived(request, browser, {"link": link_spent(request)})
    except EmailTaken:
        return _account(request, browser, invitation, typed, {"email": email_taken(request)})
    open_session(request, held, who, "password")
    return render(request, "clinician/join/codes.html", browser, codes=codes)


def account_faults(request: Request, invitation: Invitation, typed: dict[str, str]) -> dict[str, str]:
    """What is missing from name, address and organisation: field -> sentence."""
    _ = gettext_of(request)
    faults = {}
    if invitation.email:
        return {}
    if not typed["name"].strip():
        faults["name"] = _("Type your name, as families should see it.")
    if not is_email(typed["email"]):
        faults["email"] = _("Type your e-mail address.")
    if invitation.is_first and not typed["organisation"].strip():
        faults["organisation"] = _("Type the name of your organisation.")
    return faults


def password_faults(request: Request, form: FormData, own: Iterable[str]) -> dict[str, str]:
    """What is wrong with password and code: field -> sentence. own: name, e-mail and organisation of who chooses."""
    _ = gettext_of(request)
    words = {
        "length": _("Choose a password of at least 12 signs."),
        "own": _("Your name, e-mail and organisation do not count. Add 12 signs that have nothing to do with them."),
        "common": _("This is easy to guess. Choose three or four words that do not belong together."),
    }
    faults = {}
    fault = fault_of(as_typed(form, "password"), own)
    if fault is not None:
        faults["password"] = words[fault]
    if not fits(said(form, "secret"), said(form, "code")):
        faults["code"] = _("This is not the code that the app shows now.")
    return faults


def email_taken(request: Request) -> str:
    """There is an account of that address."""
    _ = gettext_of(request)
    return _("There is an account with this address. Sign in with it.")


def link_spent(request: Request) -> str:
    """The link cannot be used, and never could or not any more."""
    _ = gettext_of(request)
    return _("This link does not work any more. Ask for a new one.")


def _arrived(request: Request, browser: Visitor, errors: dict[str, str]) -> Response:
    return render(request, "clinician/join/arrived.html", browser, 422 if errors else 200, errors=errors)


def _account(
    request: Request, browser: Visitor, invitation: Invitation, typed: dict[str, str], errors: dict[str, str]
) -> Response:
    facts: dict[str, Any] = {
        "errors": errors,
        "typed": typed,
        "invitation": invitation,
        "role": role_words(request)[invitation.role],
        "picture": code_picture(typed["secret"], invitation.email or typed.get("email") or "Lubdub"),
    }
    return render(request, "clinician/join/account.html", browser, 422 if errors else 200, **facts)
