"""Signing in at the desk by the organisation's own login, when the settings name one."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.errors import SignInRefused
from lubdub.web.deps import ServicesDep, SettingsDep, VisitorDep
from lubdub.web.desk.common import HOME
from lubdub.web.desk.sign_in import open_session, sign_in_page
from lubdub.web.guard import own_path
from lubdub.web.oidc import CALLBACK, Login
from lubdub.web.pages.common import go
from lubdub.web.pages.look import gettext_of
from lubdub.web.problems import Problem, note_problem

router = APIRouter(include_in_schema=False)


@router.get("/desk/oidc")
def begin(browser: VisitorDep, held: ServicesDep, back: str = HOME, again: bool = False) -> Response:
    """On to the provider. Nothing but this browser can finish what is begun here."""
    _must_be_set(held.settings)
    login = Login(held.settings, held.staff.passkeys.new_challenge(browser.token))
    return go(login.address(own_path(back, HOME), again))


@router.get(CALLBACK)
def finish(request: Request, browser: VisitorDep, held: ServicesDep) -> Response:
    """Back from the provider: signs in the person it means."""
    _must_be_set(held.settings)
    try:
        done = Login(held.settings, held.staff.passkeys.take_challenge(browser.token)).finish(request.query_params)
        who = held.staff.logins.find(done.vouched)
    except SignInRefused:
        note_problem("not-signed-in")
        _ = gettext_of(request)
        refused = _("That login opens no account here. Ask an administrator for a link.")
        return sign_in_page(request, browser, HOME, {"email": refused}, "")
    open_session(request, held, who, "oidc-asked" if done.was_asked else "oidc")
    return go(own_path(done.back, HOME))


def _must_be_set(settings: SettingsDep) -> None:
    if not settings.oidc_issuer:
        raise Problem("page-not-found", "No organisation's login is set.")
