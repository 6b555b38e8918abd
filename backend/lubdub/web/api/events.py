"""REST: what happens to a case, told as it happens; a broken connection goes on where it stopped."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from secrets import SystemRandom
from typing import Annotated

from fastapi import APIRouter, Depends, FastAPI, Header, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from lubdub.cases.errors import CaseNotFound
from lubdub.cases.states import ENDED
from lubdub.cases.tidings import Tidings
from lubdub.cases.values import Actor, Case
from lubdub.web.api.cases import USUAL, CaseId
from lubdub.web.deps import BEARER, ReaderDep, StoreDep
from lubdub.web.following import again_and_again
from lubdub.web.listeners import Listeners

LOOK_EVERY_S = 0.4
HEAR_EVERY_S = 0.2
ASK_AGAIN_S = (20.0, 40.0)
"""Whether the listener may still know of the case is asked so long after the last time, whatever happens to it; never
by all at once, who may have come together."""
RETRY_MS = 2000


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    app.state.listeners = Listeners(Tidings(app.state.services.database).of)
    looking = asyncio.create_task(again_and_again(app.state.listeners.look_again, LOOK_EVERY_S))
    yield
    looking.cancel()
    await asyncio.gather(looking, return_exceptions=True)


router = APIRouter(tags=["cases"], dependencies=[Depends(BEARER)], responses=USUAL, lifespan=_lifespan)

LastEventId = Annotated[int, Header(alias="Last-Event-ID", ge=0, description="Go on after this event.")]


def _listened(case_id: CaseId, actor: ReaderDep, store: StoreDep) -> tuple[Actor, Case]:
    return actor, store.get(actor, case_id)


@router.get("/cases/{case_id}/events", response_class=EventSourceResponse)
async def listen_to_case(
    request: Request,
    listened: Annotated[tuple[Actor, Case], Depends(_listened)],
    store: StoreDep,
    last_event_id: LastEventId = 0,
) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events `status` and `progress`, from the first one on; ends when the case has ended."""
    actor, case = listened
    told = last_event_id
    is_stopping: Callable[[], bool] = request.app.state.is_stopping
    with request.app.state.listeners.listening(case.id, case.owner_session_id) as has_news:
        while not is_stopping():
            try:
                events = await run_in_threadpool(store.events_after, actor, case.id, told)
                is_over = not events and (await run_in_threadpool(store.get, actor, case.id)).status in ENDED
            except CaseNotFound:
                yield ServerSentEvent(event="status", data={"status": "deleted"})
                return
            for event in events:
                told = event.sequence
                yield ServerSentEvent(event=event.kind, id=str(told), data=dict(event.data), retry=RETRY_MS)
            if is_over:
                return
            if events:
                continue
            patience = time.monotonic() + SystemRandom().uniform(*ASK_AGAIN_S)
            while not is_stopping() and not has_news(told) and time.monotonic() < patience:
                await asyncio.sleep(HEAR_EVERY_S)
