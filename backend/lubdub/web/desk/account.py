"""A clinician's own account: where one is signed in, and how."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.credentials import is_secret, new_recovery_codes, new_secret
from lubdub.cases.desk_values import ClinicianSession
from lubdub.cases.errors import TooManyTries
from lubdub.cases.staff import Staff
from lubdub.web.deps import ClinicianDep, DeskGuard, FreshClinicianDep, StaffDep
from lubdub.web.desk.codes import code_picture
from lubdub.web.desk.common import SIGN_IN, role_words, show
from lubdub.web.desk.join import password_faults
from lubdub.web.pages.common import FormDep, as_typed, go, said
from lubdub.web.pages.look import gettext_of
from lubdub.web.problems import note_problem

ACCOUNT = "/desk/account"

router = APIRouter(include_in_schema=False)


@router.get(ACCOUNT)
def account(request: Request, session: ClinicianDep, staff: StaffDep) -> Response:
    """Who one is here, and every browser that is signed in."""
    return show(
        request,
        "clinician/account/account.html",
        session,
        here_id=session.id,
        sessions=staff.sessions.list_living(session.clinician),
        role=role_words(request)[session.clinician.role],
        passkeys=staff.passkeys.list_of(session.clinician),
    )


@router.get(f"{ACCOUNT}/password")
def password(request: Request, session: FreshClinicianDep) -> Response:
    """A new password and code app, instead of the old ones or beside a passkey."""
    return _password_page(request, session, new_secret(), {})


@router.post(f"{ACCOUNT}/password", dependencies=[DeskGuard])
def password_set(request: Request, session: FreshClinicianDep, form: FormDep, staff: StaffDep) -> Response:
    """Takes them over when the code shows that the app has the secret; then the spare codes, once."""
    secret, me = said(form, "secret"), session.clinician
    if not is_secret(secret):
        return go(f"{ACCOUNT}/password")
    errors = password_faults(request, form, (me.name, me.email, me.organisation))
    errors |= _current_faults(request, session, as_typed(form, "current"), staff)
    if errors:
        return _password_page(request, session, secret, errors)
    codes = new_recovery_codes()
    staff.credentials.replace(me, as_typed(form, "password"), secret, codes)
    return show(request, "clinician/join/codes.html", session, codes=codes)


def _current_faults(request: Request, session: ClinicianSession, current: str, staff: Staff) -> dict[str, str]:
    _ = gettext_of(request)
    if not session.clinician.has_password:
        return {}
    try:
        if staff.credentials.knows_password(session.clinician, current):
            return {}
    except TooManyTries:
        note_problem("too-many-requests")
        return {"current": _("Too many tries. Wait 15 minutes, then try again.")}
    note_problem("not-signed-in")
    return {"current": _("This is not your password. If you forgot it, ask an administrator for a link.")}


def _password_page(request: Request, session: ClinicianSession, secret: str, errors: dict[str, str]) -> Response:
    facts: dict[str, Any] = {
        "errors": errors,
        "secret": secret,
        "picture": code_picture(secret, session.clinician.email),
        "back": ACCOUNT,
    }
    return show(request, "clinician/account/password.html", session, 422 if errors else 200, **facts)


@router.post(f"{ACCOUNT}/sessions/end", dependencies=[DeskGuard])
def end_session(session: ClinicianDep, form: FormDep, staff: StaffDep) -> Response:
    """Signs one browser out."""
    ended = said(form, "session")
    staff.sessions.end(session.clinician, ended)
    return go(SIGN_IN if ended == session.id else ACCOUNT)


@router.post(f"{ACCOUNT}/sessions/end-others", dependencies=[DeskGuard])
def end_other_sessions(session: ClinicianDep, staff: StaffDep) -> Response:
    """Signs every other browser out."""
    staff.sessions.end_others(session.clinician, session.id)
    return go(ACCOUNT)
