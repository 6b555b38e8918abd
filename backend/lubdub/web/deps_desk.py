"""Who is signed in at the clinicians' desk, as Annotated dependencies. Import them from `deps`."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated, Any

from fastapi import Depends, Request
from starlette.requests import HTTPConnection

from lubdub.cases.clock import now
from lubdub.cases.desk_values import ClinicianSession, Role, may
from lubdub.web import guard
from lubdub.web.deps_services import ServicesDep, SettingsDep
from lubdub.web.guard import Visitor
from lubdub.web.problems import Problem


def known_clinician(connection: HTTPConnection, held: ServicesDep) -> ClinicianSession | None:
    """The clinician behind the desk's cookie, or None. Works for WebSockets too."""
    token = connection.cookies.get(guard.desk_cookie_name(held.settings))
    return None if not token else held.staff.sessions.session_of(token)


KnownClinicianDep = Annotated[ClinicianSession | None, Depends(known_clinician)]


def clinician(known: KnownClinicianDep) -> ClinicianSession:
    """Who is signed in. Raises Problem `not-signed-in`, which pages turn into the way to the sign-in page."""
    if known is None:
        raise Problem("not-signed-in", "Sign in at the clinicians' desk first.")
    return known


ClinicianDep = Annotated[ClinicianSession, Depends(clinician)]

FRESH = timedelta(minutes=10)
"""So long after signing in, somebody may change how they sign in."""


def is_fresh(session: ClinicianSession) -> bool:
    """Whether the person showed just now who they are. A login that remembers people did not ask them."""
    return session.how != "oidc" and now() - session.created_at <= FRESH


def fresh_clinician(session: ClinicianDep) -> ClinicianSession:
    """Who has just signed in. Raises Problem `sign-in-again`, which pages turn into the way there and back."""
    if not is_fresh(session):
        raise Problem("sign-in-again", "Sign in once more before you change how you sign in.")
    return session


FreshClinicianDep = Annotated[ClinicianSession, Depends(fresh_clinician)]
FreshSignIn = Depends(fresh_clinician)


def role(least: Role) -> Any:
    """A dependency: the clinician, who must have at least this role. Raises Problem `role-missing`."""

    def demanded(session: ClinicianDep) -> ClinicianSession:
        if not may(session.clinician.role, least):
            raise Problem("role-missing", f"Only somebody with the role {least} may do this.")
        return session

    return Depends(demanded)


LeadDep = Annotated[ClinicianSession, role("lead")]
AdministratorDep = Annotated[ClinicianSession, role("administrator")]


async def _desk_guard(request: Request, session: ClinicianDep, settings: SettingsDep) -> None:
    await guard.refuse_foreign(request, session, settings)


DeskGuard = Depends(_desk_guard)


def visitor(connection: HTTPConnection, settings: SettingsDep) -> Visitor:
    """A browser that is not signed in yet; its cookie, made when there is none, ties the forms to it."""
    token = connection.cookies.get(guard.desk_cookie_name(settings))
    if token:
        return Visitor(token)
    new = guard.new_visitor()
    connection.state.set_cookie = guard.desk_cookie(settings, new)
    return new


VisitorDep = Annotated[Visitor, Depends(visitor)]


async def _visitor_guard(request: Request, browser: VisitorDep, settings: SettingsDep) -> None:
    await guard.refuse_foreign(request, browser, settings)


VisitorGuard = Depends(_visitor_guard)
