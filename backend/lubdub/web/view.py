"""The door to the live 3D views: viser's page behind our cookie, and its websocket through our rules."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import Annotated
from urllib.parse import urlsplit

import websockets
from fastapi import APIRouter, FastAPI, Request, WebSocket, WebSocketDisconnect
from fastapi.responses import HTMLResponse
from pydantic import Field
from starlette.concurrency import run_in_threadpool
from websockets.asyncio.client import ClientConnection
from websockets.typing import Subprotocol

from lubdub.cases.errors import CaseNotFound
from lubdub.cases.states import TAKES_LANDMARKS
from lubdub.cases.values import Case
from lubdub.views.placing import live_page
from lubdub.views.proxy_rules import FrameTooLarge, Gate, ViewerRole
from lubdub.views.servers import ViewsFull
from lubdub.web.deps import CaseDep, KnownFamilyDep, ServicesDep
from lubdub.web.following import following
from lubdub.web.pages.look import sides_of
from lubdub.web.problems import Problem
from lubdub.web.view_desk import ViewDesk

LIVE_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob: data:; "
    "style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; connect-src 'self' blob: data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
REFUSED_QUERY = frozenset({"websocket", "playbackPath"})
"""viser would connect to, or play, whatever these name: script of strangers on our origin."""
WindowName = Annotated[str, Field(pattern="^[0-9a-f]{0,16}$")]
ROOM_AFTER_S = 120
"""When views are full: by then somebody may have gone on."""
ASK_AGAIN_S = 1.0
"""So soon after a session ended, or a case was deleted or moved, its picture is gone from other screens."""
TOO_BIG = 1009
NOT_FOR_YOU = 1008
INTERNAL = 1011
TRY_AGAIN = 1013


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    desk = ViewDesk(app.state.services.files, app.state.services.database)
    app.state.views = desk
    async with following(desk, "points"):
        yield


router = APIRouter(include_in_schema=False, lifespan=_lifespan)


@router.get("/view/{case_id}/")
@router.get("/view/{case_id}/{window}/")
def page(request: Request, case: CaseDep) -> HTMLResponse:
    """viser's page for the family's own case; its server is started when it is not running.

    window: a word by which the page that frames it tells this window's connection from others.
    """
    desk: ViewDesk = request.app.state.views
    return live_answer(request, lambda: desk.open(case.id, sides_of(request)))


def live_answer(request: Request, start: Callable[[], object]) -> HTMLResponse:
    """viser's page under its policy, once its server is started. Raises Problem `bad-request` and `not-ready`."""
    if REFUSED_QUERY & set(request.query_params):
        raise Problem("bad-request", "This address takes no such parameter.")
    try:
        start()
    except ViewsFull as error:
        words = "Many people look at a body right now. Try again in a few minutes."
        raise Problem("not-ready", words, {"Retry-After": str(ROOM_AFTER_S)}) from error
    return HTMLResponse(live_page(), headers={"Content-Security-Policy": LIVE_POLICY})


@router.websocket("/view/{case_id}")
@router.websocket("/view/{case_id}/{window}")
async def relay(
    websocket: WebSocket, case_id: str, held: ServicesDep, known: KnownFamilyDep, window: WindowName = ""
) -> None:
    """Carries the view's messages both ways for the case's own family, from our own pages only."""
    desk: ViewDesk = websocket.app.state.views
    if known is None or not is_own_origin(websocket, held.settings.address):
        return await websocket.close(NOT_FOR_YOU)
    try:
        case = await run_in_threadpool(held.store.get, known.actor, case_id)
    except CaseNotFound:
        return await websocket.close(NOT_FOR_YOU)
    view = desk.running(case_id)
    if view is None:
        return await websocket.close(NOT_FOR_YOU)
    role = await run_in_threadpool(_role, case, desk)

    def may_see() -> bool:
        return held.people.session_of(known.token) is not None and held.store.has(known.actor, case_id)

    return await join(websocket, view.port, role, lambda change: desk.watched(case_id, change, window), may_see)


async def join(
    websocket: WebSocket, port: int, role: ViewerRole, watched: Callable[[int], None], may_see: Callable[[], bool]
) -> None:
    """Connect a browser that may see the view with the view itself, until one of them ends.

    watched: told +1 when the browser came and -1 when it went.
    may_see: asked again and again; the browser is cut off once it says no.
    """
    offered = [Subprotocol(name) for name in websocket.scope.get("subprotocols", [])]
    try:
        upstream = await websockets.connect(
            f"ws://127.0.0.1:{port}", subprotocols=offered or None, max_size=None, compression=None, proxy=None
        )
    except (OSError, websockets.InvalidHandshake):
        await websocket.close(TRY_AGAIN)  # the view was just stopped; the page asks for a new one
        return
    async with upstream:
        await websocket.accept(subprotocol=upstream.subprotocol)
        watched(+1)
        try:
            await _carry(websocket, upstream, Gate(role), may_see)
        finally:
            watched(-1)


def _role(case: Case, desk: ViewDesk) -> ViewerRole:
    """Points are placed only while they are asked for; else one may only look."""
    is_asked = case.status in TAKES_LANDMARKS and desk.marks(case.id).sides_confirmed
    return "placing" if is_asked else "watching"


def is_own_origin(websocket: WebSocket, address: str) -> bool:
    """Whether the socket was opened by a page of this very host. A missing Origin is no browser of ours."""
    origin = websocket.headers.get("origin")
    if origin is None:
        return False
    return urlsplit(origin).netloc in {urlsplit(address).netloc, websocket.headers.get("host")}


async def _carry(websocket: WebSocket, upstream: ClientConnection, gate: Gate, may_see: Callable[[], bool]) -> None:
    """Both directions until one side ends, or until it may not be seen any more; the other side ends with the same."""
    tasks = {
        asyncio.create_task(_to_browser(websocket, upstream)),
        asyncio.create_task(_to_viser(websocket, upstream, gate)),
        asyncio.create_task(_until_forbidden(may_see)),
    }
    done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    code = next((task.result() for task in done if not task.cancelled() and task.exception() is None), INTERNAL)
    with suppress(RuntimeError, WebSocketDisconnect):  # the browser may have gone first
        await websocket.close(code)


async def _until_forbidden(may_see: Callable[[], bool]) -> int:
    while await run_in_threadpool(may_see):
        await asyncio.sleep(ASK_AGAIN_S)
    return NOT_FOR_YOU


async def _to_browser(websocket: WebSocket, upstream: ClientConnection) -> int:
    try:
        async for frame in upstream:
            await websocket.send_bytes(frame if isinstance(frame, bytes) else frame.encode())
    except (websockets.ConnectionClosed, WebSocketDisconnect):
        return upstream.close_code or INTERNAL
    return upstream.close_code or 1000


async def _to_viser(websocket: WebSocket, upstream: ClientConnection, gate: Gate) -> int:
    try:
        while True:
            frame = await websocket.receive_bytes()
            if gate.passes(frame):
                await upstream.send(frame)
    except FrameTooLarge:
        return TOO_BIG
    except KeyError:
        return NOT_FOR_YOU  # a text frame: viser's page never sends one
    except WebSocketDisconnect as gone:
        return gone.code
    except websockets.ConnectionClosed:
        return upstream.close_code or INTERNAL
