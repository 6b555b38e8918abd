"""The desk's first page: what waits for a review, and everything else a clinician may find. No pictures of patients."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any

from babel.dates import format_timedelta
from fastapi import APIRouter, Query, Request
from fastapi.responses import Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from lubdub.cases.clock import now
from lubdub.cases.worklist import SHELVES, Entry, Shelf
from lubdub.web.deps import ClinicianDep, WorklistDep
from lubdub.web.desk.common import OVER, is_over, show
from lubdub.web.desk.review_words import state_words
from lubdub.web.languages import language_of
from lubdub.web.pages.look import gettext_of
from lubdub.web.pages.result_words import age_words, language_in

POLL_S = 1.0
KEEP_ALIVE_POLLS = 8

router = APIRouter(include_in_schema=False)

Search = Annotated[str, Query(alias="q", max_length=200)]
ShelfQuery = Annotated[Shelf, Query(alias="show")]


@router.get("/desk")
def worklist(
    request: Request, session: ClinicianDep, cases: WorklistDep, shelf: ShelfQuery = "waiting", search: Search = ""
) -> Response:
    """The list, those that wait longest first."""
    _ = gettext_of(request)
    # Somebody who looks for one case by its id means that case, wherever it lies.
    searched: Shelf = "all" if search.strip() and "show" not in request.query_params else shelf
    counts = cases.counts(session.actor)
    titles = {
        "waiting": _("Waiting for review"),
        "decided": _("Decided"),
        "under_way": _("Under way"),
        "all": _("All"),
    }
    return show(
        request,
        "clinician/worklist/worklist.html",
        session,
        rows=[_row(request, entry) for entry in cases.entries(session.actor, searched, search)],
        shelves=[{"key": key, "title": titles[key], "count": counts[key]} for key in SHELVES],
        shelf=searched,
        search=search,
    )


@router.get("/desk/live", response_class=EventSourceResponse)
async def live(request: Request, session: ClinicianDep, cases: WorklistDep) -> AsyncIterator[ServerSentEvent]:
    """Says that something changed on the list; the page then asks for it anew."""
    told, silent = "", 0
    while not await is_over(request, session):
        state = await run_in_threadpool(cases.state, session.actor)
        if state != told or silent >= KEEP_ALIVE_POLLS:
            told, silent = state, 0
            yield ServerSentEvent(event="marks", data={"version": state}, retry=2000)
        silent += 1
        await asyncio.sleep(POLL_S)
    if not request.app.state.is_stopping():
        yield OVER


def _row(request: Request, entry: Entry) -> dict[str, Any]:
    """What is said of a case in the list: enough to choose by, and no more."""
    _, case = gettext_of(request), entry.case
    sexes = {"female": _("Female"), "male": _("Male")}
    since = format_timedelta(now() - entry.since, locale=language_of(request), granularity="minute")
    return {
        "id": case.id,
        "short": case.id[:6],
        "external": case.external_id or "",
        "who": ", ".join(
            one
            for one in (sexes.get(case.sex or "", ""), age_words(language_in(language_of(request)), case.age_years))
            if one
        ),
        "is_sample": case.person == "sample",
        "state": state_words(_)[case.status],
        "waits": case.status == "in_review",
        "since": since,
        "at": entry.since.isoformat(),
    }
