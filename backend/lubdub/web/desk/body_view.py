"""The door to the live view of a reference body that is marked: each clinician's own, from our own pages only."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import APIRouter, Depends, FastAPI, Request, WebSocket
from fastapi.responses import HTMLResponse
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from lubdub.cases.errors import BodyNotFound
from lubdub.jobs.reference_marks import MarkedBody
from lubdub.views.proxy_rules import ViewerRole
from lubdub.web.body_views import BodyViews
from lubdub.web.deps import ClinicianDep, KnownClinicianDep, ReferenceMarksDep, ServicesDep
from lubdub.web.desk.view import reviewer
from lubdub.web.following import following
from lubdub.web.pages.look import sides_of
from lubdub.web.view import NOT_FOR_YOU, WindowName, is_own_origin, join, live_answer


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    views = BodyViews(app.state.services.reference_marks)
    app.state.body_views = views
    async with following(views, "bodies"):
        yield


router = APIRouter(include_in_schema=False, lifespan=_lifespan)


def _views(connection: HTTPConnection) -> BodyViews:
    views: BodyViews = connection.app.state.body_views
    return views


BodyViewsDep = Annotated[BodyViews, Depends(_views)]


def desk_body(body: str, session: ClinicianDep, marks: ReferenceMarksDep) -> MarkedBody:
    """The body, as it stands for the clinician, who may see it. Raises BodyNotFound, shown as 404."""
    return marks.told(reviewer(session), body)


BodyDep = Annotated[MarkedBody, Depends(desk_body)]


@router.get("/desk/body/{body}/{window}/")
def page(
    request: Request, body: BodyDep, session: ClinicianDep, views: BodyViewsDep, window: WindowName
) -> HTMLResponse:
    """viser's page for the clinician's own view of the body."""
    return live_answer(request, lambda: views.open(body.card["id"], reviewer(session), sides_of(request)))


@router.websocket("/desk/body/{body}/{window}")
async def relay(
    websocket: WebSocket,
    body: str,
    held: ServicesDep,
    known: KnownClinicianDep,
    views: BodyViewsDep,
    window: WindowName,
) -> None:
    """Carries the view's messages both ways; areas are placed only until the marks are handed in."""
    if known is None or not is_own_origin(websocket, held.settings.address):
        return await websocket.close(NOT_FOR_YOU)
    by = reviewer(known)
    try:
        told = await run_in_threadpool(held.reference_marks.told, by, body)
    except BodyNotFound:
        return await websocket.close(NOT_FOR_YOU)
    view = views.running(body, by)
    if view is None:
        return await websocket.close(NOT_FOR_YOU)
    role: ViewerRole = "watching" if told.is_closed else "placing"

    def may_see() -> bool:
        return held.staff.sessions.is_living(known.id)

    return await join(websocket, view.port, role, lambda change: views.watched(body, by, change, window), may_see)
