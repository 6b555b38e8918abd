"""What endpoints and pages ask for, as Annotated dependencies.

Pages: `FamilyDep` (makes the session when there is none; the cookie is set on whatever is returned), `CaseDep`
(the family's own case of the path's `case_id`, else 404), `FormGuard` (put it in the route's `dependencies` of
every form), `csrf_token(family)` for the form's hidden field `csrf_token`.
REST: `ReaderDep`, `WriterDep` (the actor: a portal's key with the scope, or a family's own session).
All services: `StoreDep`, `FilesDep`, `ActionsDep`, `EngineDep`, `SettingsDep`.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request
from starlette.requests import HTTPConnection

from lubdub.cases.files import FileVault
from lubdub.cases.store import CaseStore
from lubdub.cases.values import Actor, Case, FamilySession
from lubdub.jobs.engine import JobEngine
from lubdub.settings import Settings
from lubdub.web import guard
from lubdub.web.actions import CaseActions
from lubdub.web.guard import csrf_token
from lubdub.web.problems import Problem
from lubdub.web.services import Services

__all__ = [
    "ActionsDep",
    "CaseDep",
    "EngineDep",
    "FamilyDep",
    "FilesDep",
    "FormGuard",
    "KnownFamilyDep",
    "ReaderDep",
    "ServicesDep",
    "SettingsDep",
    "StoreDep",
    "WriterDep",
    "csrf_token",
    "own_case",
]


def services(connection: HTTPConnection) -> Services:
    """What this process holds."""
    held: Services = connection.app.state.services
    return held


ServicesDep = Annotated[Services, Depends(services)]


def _settings(held: ServicesDep) -> Settings:
    return held.settings


def _store(held: ServicesDep) -> CaseStore:
    return held.store


def _files(held: ServicesDep) -> FileVault:
    return held.files


def _actions(held: ServicesDep) -> CaseActions:
    return held.actions


def _engine(held: ServicesDep) -> JobEngine:
    return held.engine


SettingsDep = Annotated[Settings, Depends(_settings)]
StoreDep = Annotated[CaseStore, Depends(_store)]
FilesDep = Annotated[FileVault, Depends(_files)]
ActionsDep = Annotated[CaseActions, Depends(_actions)]
EngineDep = Annotated[JobEngine, Depends(_engine)]


def known_family(connection: HTTPConnection, held: ServicesDep) -> FamilySession | None:
    """The session behind the cookie, or None. Works for WebSockets too."""
    token = connection.cookies.get(guard.cookie_name(held.settings))
    return None if not token else held.people.session_of(token)


KnownFamilyDep = Annotated[FamilySession | None, Depends(known_family)]


def family(connection: HTTPConnection, held: ServicesDep, known: KnownFamilyDep) -> FamilySession:
    """The browser's session; a new one, with its cookie, when there is none."""
    if known is not None:
        return known
    session = held.people.open_session(held.settings.session_hours)
    connection.state.set_cookie = guard.session_cookie(held.settings, session)
    return session


FamilyDep = Annotated[FamilySession, Depends(family)]


def own_case(case_id: str, session: FamilyDep, store: StoreDep) -> Case:
    """The case, if it is this family's. Raises CaseNotFound, shown as 404."""
    return store.get(session.actor, case_id)


CaseDep = Annotated[Case, Depends(own_case)]


async def _form_guard(request: Request, session: FamilyDep, settings: SettingsDep) -> None:
    guard.refuse_cross_site(request, settings)
    form = await request.form()
    token = form.get(guard.CSRF_FIELD)
    guard.refuse_wrong_token(session, token if isinstance(token, str) else None)


FormGuard = Depends(_form_guard)


def _actor(request: Request, held: ServicesDep, scope: str) -> Actor:
    """A bearer key counts alone: with one, cookies are not looked at."""
    kind, _, token = request.headers.get("authorization", "").partition(" ")
    if kind:
        key = held.people.key_of(token.strip()) if kind.lower() == "bearer" else None
        if key is None:
            raise Problem("not-signed-in", "This key is not known or was revoked.", {"WWW-Authenticate": "Bearer"})
        if scope not in key.scopes:
            raise Problem("scope-missing", f"This call needs a key with the scope {scope}.")
        return Actor("key", key.id, key.tenant_id)
    session = known_family(request, held)
    if session is None:
        raise Problem("not-signed-in", "Send a key as a bearer token.", {"WWW-Authenticate": "Bearer"})
    if request.method not in guard.SAFE_METHODS:
        guard.refuse_cross_site(request, held.settings)
        guard.refuse_wrong_token(session, request.headers.get(guard.CSRF_HEADER))
    return session.actor


def _reader(request: Request, held: ServicesDep) -> Actor:
    return _actor(request, held, "cases:read")


def _writer(request: Request, held: ServicesDep) -> Actor:
    return _actor(request, held, "cases:write")


ReaderDep = Annotated[Actor, Depends(_reader)]
WriterDep = Annotated[Actor, Depends(_writer)]
