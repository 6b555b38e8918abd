"""Reference bodies at the desk: the list, and marking the areas on one, with nobody else's marks in sight."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator, Callable
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from lubdub.cases.desk_values import ClinicianSession
from lubdub.cases.errors import ReviewMoved, StateConflict
from lubdub.cases.reviewing import Reviewer
from lubdub.jobs.reference_marks import MarkedBody, ReferenceMarks
from lubdub.results import AREA_NAMES, AreaName
from lubdub.web.body_views import BodyViews
from lubdub.web.deps import ClinicianDep, DeskGuard, ReferenceMarksDep
from lubdub.web.desk.body_view import BodyDep, BodyViewsDep
from lubdub.web.desk.common import OVER, is_over, show
from lubdub.web.desk.references_words import BodyWords
from lubdub.web.desk.review import KEEP_ALIVE_POLLS, POLL_S, number_said
from lubdub.web.desk.view import reviewer
from lubdub.web.pages.common import FormDep, go, said, wants_json
from lubdub.web.pages.look import gettext_of, render_part
from lubdub.web.problems import Problem
from lubdub.web.view import WindowName

PAGE = "/desk/references"
ONE = f"{PAGE}/{{body}}"

router = APIRouter(include_in_schema=False)


@router.get(PAGE)
def bodies(request: Request, session: ClinicianDep, marks: ReferenceMarksDep) -> Response:
    """Every body, who placed its areas, and how far the clinician's own marks are."""
    rows = [BodyWords(request, told).row() for told in marks.list_all(reviewer(session))]
    return show(request, "clinician/references/references.html", session, rows=rows, can_keep=marks.can_keep)


@router.get(ONE)
def body_page(request: Request, body: BodyDep, session: ClinicianDep, marks: ReferenceMarksDep) -> Response:
    """The body in 3D, to be marked."""
    marks.note_reading(reviewer(session), body.card["id"])
    facts = {"window": secrets.token_hex(4), "back": PAGE, **_panel_facts(request, body, None)}
    return show(request, "clinician/references/mark.html", session, **facts)


@router.get(f"{ONE}/panel")
def panel(request: Request, body: BodyDep, session: ClinicianDep, current: str = "") -> JSONResponse:
    """The areas and buttons as they are now."""
    return _fragments(request, body, session, current)


@router.get(f"{ONE}/live", response_class=EventSourceResponse)
async def live(
    request: Request,
    body: BodyDep,
    session: ClinicianDep,
    marks: ReferenceMarksDep,
    views: BodyViewsDep,
    window: WindowName = "",
) -> AsyncIterator[ServerSentEvent]:
    """Tells the page when something was marked, and whether its own window of the view is connected."""
    by, name, told, silent = reviewer(session), body.card["id"], None, 0
    while not await is_over(request, session):
        stands = await run_in_threadpool(marks.told, by, name)
        status = "closed" if stands.is_closed else "open"
        now = (stands.mine.version, status, views.is_watched(name, by, window))
        if now != told or silent >= KEEP_ALIVE_POLLS:
            told, silent = now, 0
            yield ServerSentEvent(
                event="marks", data={"version": now[0], "status": status, "connected": now[2]}, retry=1000
            )
        silent += 1
        await asyncio.sleep(POLL_S)
    if not request.app.state.is_stopping():
        yield OVER


@router.post(f"{ONE}/look", dependencies=[DeskGuard])
def look_around(body: BodyDep, session: ClinicianDep, views: BodyViewsDep) -> Response:
    """The whole chest again. Nothing is stored."""
    views.look_at_all(body.card["id"], reviewer(session))
    return Response(status_code=204)


@router.post(f"{ONE}/review", dependencies=[DeskGuard])
def act(
    request: Request,
    body: BodyDep,
    session: ClinicianDep,
    form: FormDep,
    marks: ReferenceMarksDep,
    views: BodyViewsDep,
) -> Response:
    """One button of the marking page."""
    _, name = gettext_of(request), body.card["id"]
    acting = _Acting(name, reviewer(session), form, marks, views)
    try:
        is_done = acting.do(said(form, "action"))
    except ReviewMoved as error:
        message = _("These marks went on in another window. Look at them as they are now, and do it again.")
        raise Problem("state-conflict", message) from error
    except StateConflict as error:
        raise Problem("state-conflict", _("That cannot be done with this body now.")) from error
    views.follow(name, acting.by)
    if is_done:
        return JSONResponse({"next": PAGE}) if wants_json(request) else go(PAGE)
    if wants_json(request):
        return _fragments(request, marks.told(acting.by, name), session, said(form, "area"))
    return go(f"{PAGE}/{name}")


class _Acting:
    """What the buttons do."""

    def __init__(self, body: str, by: Reviewer, form: FormDep, marks: ReferenceMarks, views: BodyViews) -> None:
        self.body, self.by = body, by
        self._form, self._marks, self._views = form, marks, views

    def do(self, action: str) -> bool:
        """Do it; True when the body is done with. Raises Problem `bad-request`, StateConflict."""
        deeds: dict[str, Callable[[], bool]] = {
            "look": self._take_in_hand,
            "move": self._move,
            "undo": self._undo,
            "hand_in": self._hand_in,
            "withdraw": self._withdraw,
        }
        if action not in deeds:
            raise Problem("bad-request", "There is no such button.")
        return deeds[action]()

    def _area(self) -> AreaName:
        name = _known(said(self._form, "area"))
        if name is None:
            raise Problem("bad-request", "There is no such area.")
        return name

    def _version(self) -> int:
        return number_said(said(self._form, "version"))

    def _take_in_hand(self) -> bool:
        self._views.take_in_hand(self.body, self.by, self._area())
        return False

    def _move(self) -> bool:
        left, up = (number_said(said(self._form, way)) for way in ("left_mm", "up_mm"))
        mine, area = self._marks.mine(self.by, self.body), self._area()
        place = self._views.nudged(mine, self.by, area, left, up)
        self._marks.place(self.by, self.body, self._version(), area, place)
        return False

    def _undo(self) -> bool:
        self._marks.undo(self.by, self.body, self._version())
        return False

    def _hand_in(self) -> bool:
        self._marks.hand_in(self.by, self.body, self._version())
        self._views.take_in_hand(self.body, self.by, None)
        return True

    def _withdraw(self) -> bool:
        self._marks.withdraw(self.by, self.body)
        return True


def _known(word: str) -> AreaName | None:
    return next((one for one in AREA_NAMES if one == word), None)


def _panel_facts(request: Request, told: MarkedBody, current: AreaName | None) -> dict[str, Any]:
    words = BodyWords(request, told)
    return {
        "name": told.card["id"],
        "person": words.person(),
        "areas": words.areas(current),
        "upcoming": words.upcoming(current),
        "landmarks": words.landmarks(),
        "is_open": not told.is_closed,
        "is_agreed": told.spread_mm is not None,
        "is_mine": bool(told.mine.handed_in_at),
        "can_undo": bool(told.mine.steps),
        "version": told.mine.version,
    }


def _fragments(request: Request, told: MarkedBody, session: ClinicianSession, current: str) -> JSONResponse:
    facts = _panel_facts(request, told, _known(current))
    page = render_part(request, "clinician/references/panel.html", session, **facts)
    return JSONResponse({"panel": page, "version": told.mine.version})
