"""What endpoints and pages ask for, as Annotated dependencies.

Pages: `FamilyDep` (makes the session when there is none; the cookie is set on whatever is returned), `CaseDep`
(the family's own case of the path's `case_id`, else 404), `FormGuard` (put it in the route's `dependencies` of
every form), `csrf_token(family)` for the form's hidden field `csrf_token`.
The desk: `ClinicianDep` (who is signed in; else pages lead to the sign-in page, scripts and sockets get 401),
`FreshClinicianDep`, or `FreshSignIn` in the `dependencies` (who signed in just now; else to the sign-in page and back),
`LeadDep`, `AdministratorDep` or `role(...)` (the same with at least that role, else 403), `DeskGuard` (in the
`dependencies` of everything that changes), `VisitorDep` and `VisitorGuard` for pages before signing in.
REST: `ReaderDep`, `WriterDep` (the actor: a portal's key with the scope, or a family's own session); for what only
portals have `KeyManagerDep`, `WebhookManagerDep`, `PortalReaderDep`,
`PortalWriterDep`.
All services: `StoreDep`, `ReviewsDep`, `DraftsDep`, `FilesDep`, `ActionsDep`, `EngineDep`, `SettingsDep`.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request, Security
from fastapi.openapi.models import OAuthFlowClientCredentials, OAuthFlows
from fastapi.security import HTTPBearer, OAuth2, SecurityScopes
from starlette.requests import HTTPConnection

from lubdub.cases.values import Actor, Case, FamilySession
from lubdub.web import guard
from lubdub.web.deps_desk import (
    AdministratorDep,
    ClinicianDep,
    DeskGuard,
    FreshClinicianDep,
    FreshSignIn,
    KnownClinicianDep,
    LeadDep,
    VisitorDep,
    VisitorGuard,
    is_fresh,
    known_clinician,
    role,
)
from lubdub.web.deps_services import (
    ActionsDep,
    DraftsDep,
    EmbeddingDep,
    EngineDep,
    FilesDep,
    KeysDep,
    LinksDep,
    ListingDep,
    QuotasDep,
    ReferenceMarksDep,
    ReviewsDep,
    ServicesDep,
    SettingsDep,
    StaffDep,
    StoreDep,
    UploadsDep,
    WebhooksDep,
    WorklistDep,
)
from lubdub.web.framing import FRAMED_PAGES, note_framing
from lubdub.web.guard import csrf_token
from lubdub.web.problems import Problem

__all__ = [
    "BEARER",
    "ActionsDep",
    "AdministratorDep",
    "CaseDep",
    "ClinicianDep",
    "DeskGuard",
    "DraftsDep",
    "EmbeddingDep",
    "EngineDep",
    "FamilyDep",
    "FilesDep",
    "FormGuard",
    "FreshClinicianDep",
    "FreshSignIn",
    "KeyManagerDep",
    "KeysDep",
    "KnownClinicianDep",
    "KnownFamilyDep",
    "LeadDep",
    "LinksDep",
    "ListingDep",
    "ManagerScopesDep",
    "PortalReaderDep",
    "PortalWriterDep",
    "QuotasDep",
    "ReaderDep",
    "ReferenceMarksDep",
    "ReviewsDep",
    "ServicesDep",
    "SettingsDep",
    "StaffDep",
    "StoreDep",
    "UploadsDep",
    "VisitorDep",
    "VisitorGuard",
    "WebhookManagerDep",
    "WebhooksDep",
    "WorklistDep",
    "WriterDep",
    "csrf_token",
    "is_fresh",
    "known_clinician",
    "own_case",
    "role",
]


BEARER = HTTPBearer(auto_error=False, description="A portal's key or token: `Authorization: Bearer lubdub_...`")
SCOPE_WORDS = {
    "cases:read": "Read cases and what came of them.",
    "cases:write": "Open, change and delete cases.",
    "keys:manage": "Make and end keys, and say whose pages may frame cases.",
    "webhooks:manage": "Be told by webhooks.",
}
OAUTH2 = OAuth2(
    flows=OAuthFlows(clientCredentials=OAuthFlowClientCredentials(tokenUrl="/api/v1/oauth/token", scopes=SCOPE_WORDS)),
    auto_error=False,
)
"""BEARER and OAUTH2 are how the documentation says who calls, and with which scopes; `_caller` is what looks."""
ShownDep = Annotated[str | None, Depends(OAUTH2)]


def known_family(connection: HTTPConnection, held: ServicesDep) -> FamilySession | None:
    """The session behind the cookie, or None. Works for WebSockets too.

    A browser may hold a second one, of a portal's frame; it counts for the case it was made for.
    """
    own, framed = (
        None if not token else held.people.session_of(token)
        for token in map(connection.cookies.get, guard.cookie_names(held.settings))
    )
    case_id = connection.path_params.get("case_id")
    if framed is not None and (own is None or (case_id is not None and held.store.has(framed.actor, case_id))):
        note_framing(connection, framed)
        return framed
    return own


KnownFamilyDep = Annotated[FamilySession | None, Depends(known_family)]


def family(connection: HTTPConnection, held: ServicesDep, known: KnownFamilyDep) -> FamilySession:
    """The browser's session; a new one, with its cookie, when there is none."""
    if known is not None:
        if known.is_embedded and not connection.url.path.startswith(FRAMED_PAGES):
            raise Problem("page-not-found", "This page is not part of the frame.")
        return known
    session = held.people.open_session(held.settings.session_hours)
    connection.state.set_cookie = guard.session_cookie(held.settings, session)
    return session


FamilyDep = Annotated[FamilySession, Depends(family)]


def own_case(case_id: str, connection: HTTPConnection, session: FamilyDep, store: StoreDep) -> Case:
    """The case, if it is this family's. Raises CaseNotFound, shown as 404. Pages then speak of its person."""
    case = store.get(session.actor, case_id)
    connection.state.person = case.person
    connection.state.case = case
    return case


CaseDep = Annotated[Case, Depends(own_case)]


async def _form_guard(request: Request, session: FamilyDep, settings: SettingsDep) -> None:
    await guard.refuse_foreign(request, session, settings)


FormGuard = Depends(_form_guard)


def _caller(request: Request, held: ServicesDep, needed: SecurityScopes, shown: ShownDep) -> Actor:
    """A bearer key counts alone: with one, cookies are not looked at. It must have every scope needed."""
    kind, _, token = request.headers.get("authorization", "").partition(" ")
    if kind:
        key = held.keys.known(token.strip()) if kind.lower() == "bearer" else None
        if key is None:
            raise Problem("not-signed-in", "This key is not known or was revoked.", {"WWW-Authenticate": "Bearer"})
        missing = [scope for scope in needed.scopes if scope not in key.scopes]
        if missing:
            raise Problem("scope-missing", f"This call needs a key with the scope {missing[0]}.")
        return key.actor
    session = known_family(request, held)
    if session is None:
        raise Problem("not-signed-in", "Send a key as a bearer token.", {"WWW-Authenticate": "Bearer"})
    if request.method not in guard.SAFE_METHODS:
        guard.refuse_cross_site(request, held.settings)
        guard.refuse_wrong_token(session, request.headers.get(guard.CSRF_HEADER))
    return session.actor


def _portal(request: Request, held: ServicesDep, needed: SecurityScopes, shown: ShownDep) -> Actor:
    """For what families do not have: a session does not count, only a key or a token."""
    if not request.headers.get("authorization"):
        raise Problem("not-signed-in", "Send a key as a bearer token.", {"WWW-Authenticate": "Bearer"})
    return _caller(request, held, needed, shown)


KeyManagerDep = Annotated[Actor, Security(_portal, scopes=["keys:manage"])]
WebhookManagerDep = Annotated[Actor, Security(_portal, scopes=["webhooks:manage"])]
PortalReaderDep = Annotated[Actor, Security(_portal, scopes=["cases:read"])]
PortalWriterDep = Annotated[Actor, Security(_portal, scopes=["cases:write"])]


def _manager_scopes(request: Request, held: ServicesDep, manager: KeyManagerDep) -> tuple[str, ...]:
    """What the key that calls may do itself."""
    key = held.keys.known(request.headers["authorization"].partition(" ")[2].strip())
    return () if key is None else key.scopes


ReaderDep = Annotated[Actor, Security(_caller, scopes=["cases:read"])]
WriterDep = Annotated[Actor, Security(_caller, scopes=["cases:write"])]
ManagerScopesDep = Annotated[tuple[str, ...], Depends(_manager_scopes)]
