"""The door to the live view of a result in review: for clinicians who may see the case, from our own pages only."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import APIRouter, Depends, FastAPI, Request, WebSocket
from fastapi.responses import HTMLResponse
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from lubdub.cases.desk_values import ClinicianSession
from lubdub.cases.errors import CaseNotFound
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.snapshots import Snapshots
from lubdub.cases.states import HAS_RESULT
from lubdub.cases.values import Case
from lubdub.views.proxy_rules import ViewerRole
from lubdub.web.deps import ClinicianDep, KnownClinicianDep, ServicesDep, StoreDep
from lubdub.web.following import following
from lubdub.web.pages.look import sides_of
from lubdub.web.problems import Problem
from lubdub.web.review_views import ReviewViews
from lubdub.web.view import NOT_FOR_YOU, WindowName, is_own_origin, join, live_answer


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    services = app.state.services
    views = ReviewViews(services.files, services.reviews, Snapshots(services.database))
    app.state.review_views = views
    async with following(views, "review"):
        yield


router = APIRouter(include_in_schema=False, lifespan=_lifespan)


def _views(connection: HTTPConnection) -> ReviewViews:
    views: ReviewViews = connection.app.state.review_views
    return views


ReviewViewsDep = Annotated[ReviewViews, Depends(_views)]


def reviewer(session: ClinicianSession) -> Reviewer:
    """Who reviews, as reviews are signed."""
    return Reviewer(session.actor, session.clinician.name)


def desk_case(case_id: str, session: ClinicianDep, store: StoreDep, connection: HTTPConnection) -> Case:
    """The case, if the clinician may know of it. Raises CaseNotFound, shown as 404."""
    connection.state.person = "other"
    return store.get(session.actor, case_id)


DeskCaseDep = Annotated[Case, Depends(desk_case)]


@router.get("/desk/view/{case_id}/{window}/")
def page(
    request: Request, case: DeskCaseDep, session: ClinicianDep, views: ReviewViewsDep, window: WindowName
) -> HTMLResponse:
    """viser's page for the clinician's own view of the case."""
    if case.status not in HAS_RESULT:
        raise Problem("file-not-ready", "There is no result to look at.")
    return live_answer(request, lambda: views.open(case, reviewer(session), sides_of(request)))


@router.websocket("/desk/view/{case_id}/{window}")
async def relay(
    websocket: WebSocket,
    case_id: str,
    held: ServicesDep,
    known: KnownClinicianDep,
    views: ReviewViewsDep,
    window: WindowName,
) -> None:
    """Carries the view's messages both ways for the clinician whose view it is; areas move only during a review."""
    if known is None or not is_own_origin(websocket, held.settings.address):
        return await websocket.close(NOT_FOR_YOU)
    by = reviewer(known)
    try:
        case = await run_in_threadpool(held.store.get, by.actor, case_id)
    except CaseNotFound:
        return await websocket.close(NOT_FOR_YOU)
    view = views.running(case_id, by)
    if view is None:
        return await websocket.close(NOT_FOR_YOU)
    role: ViewerRole = "moving" if case.status == "in_review" else "watching"

    def may_see() -> bool:
        return held.staff.sessions.is_living(known.id) and held.store.has(by.actor, case_id)

    return await join(websocket, view.port, role, lambda change: views.watched(case_id, by, change, window), may_see)
