"""Signing in at the desk by the organisation's own login, when the settings name one."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.desk_values import Clinician
from lubdub.cases.errors import SignInRefused
from lubdub.web.deps import ServicesDep, SettingsDep, VisitorDep
from lubdub.web.desk_common import HOME
from lubdub.web.desk_sign_in import open_session, sign_in_page
from lubdub.web.guard import Visitor
from lubdub.web.oidc import CALLBACK, Login
from lubdub.web.pages_common import go
from lubdub.web.pages_look import gettext_of
from lubdub.web.problems import Problem
from lubdub.web.services import Services

router = APIRouter(include_in_schema=False)


@router.get("/desk/oidc")
def begin(browser: VisitorDep, held: ServicesDep) -> Response:
    """On to the provider. Nothing but this browser can finish what is begun here."""
    _must_be_set(held.settings)
    return go(Login(held.settings, held.staff.passkeys.new_challenge(browser.token)).address())


@router.get(CALLBACK)
def finish(request: Request, browser: VisitorDep, held: ServicesDep) -> Response:
    """Back from the provider: signs in whoever has an account here under the address it vouches for."""
    _must_be_set(held.settings)
    try:
        who = _vouched(request, browser, held)
    except SignInRefused:
        _ = gettext_of(request)
        refused = _("That login opens no account here. Ask an administrator for a link.")
        return sign_in_page(request, browser, HOME, {"email": refused}, "")
    open_session(request, held, who, "oidc")
    return go(HOME)


def _vouched(request: Request, browser: Visitor, held: Services) -> Clinician:
    challenge = held.staff.passkeys.take_challenge(browser.token)
    who = held.staff.clinicians.find(Login(held.settings, challenge).email(request.query_params))
    if who is None or who.disabled_at is not None:
        raise SignInRefused("oidc")
    return who


def _must_be_set(settings: SettingsDep) -> None:
    if not settings.oidc_issuer:
        raise Problem("page-not-found", "No organisation's login is set.")
