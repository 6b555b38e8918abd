"""REST: what happens to a case, told as it happens; a broken connection goes on where it stopped."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from lubdub.cases.errors import CaseNotFound
from lubdub.cases.states import ENDED
from lubdub.cases.values import Actor, Case
from lubdub.web.api_cases import USUAL, CaseId
from lubdub.web.deps import BEARER, ReaderDep, StoreDep

POLL_S = 0.4
RETRY_MS = 2000

router = APIRouter(tags=["cases"], dependencies=[Depends(BEARER)], responses=USUAL)

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
    while not request.app.state.is_stopping():
        try:
            events = await run_in_threadpool(store.events_after, actor, case.id, told)
        except CaseNotFound:
            yield ServerSentEvent(event="status", data={"status": "deleted"})
            return
        for event in events:
            told = event.sequence
            yield ServerSentEvent(event=event.kind, id=str(told), data=dict(event.data), retry=RETRY_MS)
        if not events:
            now = await run_in_threadpool(store.get, actor, case.id)
            if now.status in ENDED:
                return
            await asyncio.sleep(POLL_S)
