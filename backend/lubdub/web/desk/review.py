"""Reviewing one case: the page, its stream, and every button on it."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator, Callable, Mapping
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from lubdub.cases.errors import FileNotFound, ReviewMoved, StateConflict
from lubdub.cases.files import FileVault
from lubdub.cases.review import Decision, Reviews
from lubdub.cases.review_reasons import RETURN_REASONS, UNUSABLE_REASONS
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.states import HAS_RESULT
from lubdub.cases.values import Case
from lubdub.report.archive import outcome_from_bytes
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, Reason
from lubdub.views.reviewing import LAYERS, Layer
from lubdub.web.deps import ActionsDep, ClinicianDep, DeskGuard, FilesDep, ReviewsDep, StoreDep
from lubdub.web.desk.common import HOME, OVER, is_over, show
from lubdub.web.desk.review_words import ReviewWords, Stand, decline_choices, state_words
from lubdub.web.desk.view import DeskCaseDep, ReviewViewsDep, reviewer
from lubdub.web.pages.common import FormDep, go, said, wants_json
from lubdub.web.pages.look import gettext_of, render_part
from lubdub.web.problems import Problem
from lubdub.web.review_views import ReviewViews
from lubdub.web.reviewed import with_corrections
from lubdub.web.view import WindowName

POLL_S = 0.4
KEEP_ALIVE_POLLS = 12
YES_OR_NO = {"yes": True, "no": False}

router = APIRouter(include_in_schema=False)


@router.get("/desk/cases/{case_id}")
def review(
    request: Request, case: DeskCaseDep, session: ClinicianDep, files: FilesDep, reviews: ReviewsDep, store: StoreDep
) -> Response:
    """The body with its areas, and all a clinician needs to decide."""
    store.note_reading(session.actor, case.id, "review.read")
    by, window = reviewer(session), secrets.token_hex(4)
    facts: dict[str, Any] = {"case_id": case.id, "case": case, "external": case.external_id or "", "back": HOME}
    stand = _stand(case, by, files, reviews)
    if stand is None:
        states = state_words(gettext_of(request))
        return show(request, "clinician/review/without.html", session, state=states[case.status], **facts)
    words_of_case = ReviewWords(request, stand)
    return show(
        request,
        "clinician/review/review.html",
        session,
        window=window,
        person=words_of_case.person(),
        verdict=words_of_case.verdict(),
        reasons=words_of_case.reasons(),
        numbers=words_of_case.numbers(),
        references=words_of_case.references(),
        method=words_of_case.method(),
        has_fit=stand.outcome.fit is not None,
        **facts,
        **_panel_facts(request, stand),
    )


@router.get("/desk/cases/{case_id}/panel")
def panel(
    request: Request,
    case: DeskCaseDep,
    session: ClinicianDep,
    files: FilesDep,
    reviews: ReviewsDep,
    current: str = "",
) -> JSONResponse:
    """The areas and buttons as they are now."""
    return _fragments(request, case, session, files, reviews, current)


@router.get("/desk/cases/{case_id}/live", response_class=EventSourceResponse)
async def live(
    request: Request,
    case: DeskCaseDep,
    session: ClinicianDep,
    reviews: ReviewsDep,
    store: StoreDep,
    views: ReviewViewsDep,
    window: WindowName = "",
) -> AsyncIterator[ServerSentEvent]:
    """Tells the page when the review went on, and whether its own window of the view is connected."""
    by, told, silent = reviewer(session), None, 0
    while not await is_over(request, session):
        version = (await run_in_threadpool(reviews.read, by.actor, case.id)).version
        status = (await run_in_threadpool(store.get, by.actor, case.id)).status
        running = views.running(case.id, by)
        if running is not None and running.content.version != version and status in HAS_RESULT:
            await run_in_threadpool(views.follow, case.id, by)
        now = (version, status, views.is_watched(case.id, by, window))
        if now != told or silent >= KEEP_ALIVE_POLLS:
            told, silent = now, 0
            data = {"version": version, "status": status, "connected": now[2]}
            yield ServerSentEvent(event="marks", data=data, retry=1000)
        silent += 1
        await asyncio.sleep(POLL_S)
    if not request.app.state.is_stopping():
        yield OVER


@router.post("/desk/cases/{case_id}/look", dependencies=[DeskGuard])
def look_around(case: DeskCaseDep, session: ClinicianDep, form: FormDep, views: ReviewViewsDep) -> Response:
    """How the clinician looks at it: which layer, as computed or corrected, the whole chest. Nothing is stored."""
    by = reviewer(session)
    layer = said(form, "layer")
    known: Layer | None = next((one for one in LAYERS if one == layer), None)
    before, pins = (YES_OR_NO.get(said(form, what)) for what in ("before", "pins"))
    if known is not None or before is not None or pins is not None:
        views.dress(case.id, by, known, before, pins)
    else:
        views.look(case.id, by, None)
    return Response(status_code=204)


@router.post("/desk/cases/{case_id}/review", dependencies=[DeskGuard])
def act(
    request: Request,
    case: DeskCaseDep,
    session: ClinicianDep,
    form: FormDep,
    files: FilesDep,
    reviews: ReviewsDep,
    views: ReviewViewsDep,
    actions: ActionsDep,
) -> Response:
    """One button of the review."""
    _ = gettext_of(request)
    acting = _Acting(case, reviewer(session), form, reviews, views, actions)
    try:
        is_done = acting.do(said(form, "action"))
    except ReviewMoved as error:
        message = _("Somebody else went on with this review. Look at it as it is now, and do it again.")
        raise Problem("state-conflict", message) from error
    except StateConflict as error:
        raise Problem("state-conflict", _("That cannot be done with this case now.")) from error
    except _NotInThePicture as error:
        message = _("The picture is not there yet. Wait until it is, and look again.")
        raise Problem("not-ready", message) from error
    views.follow(case.id, acting.by)
    if is_done:
        return JSONResponse({"next": HOME}) if wants_json(request) else go(HOME)
    if wants_json(request):
        return _fragments(request, case, session, files, reviews, said(form, "area"))
    return go(f"/desk/cases/{case.id}")


class _NotInThePicture(Exception):
    """An area is looked at in the picture, and this window has none yet."""


class _Acting:
    """What the buttons do."""

    def __init__(
        self, case: Case, by: Reviewer, form: FormDep, reviews: Reviews, views: ReviewViews, actions: ActionsDep
    ) -> None:
        self.case, self.by = case, by
        self._form, self._reviews, self._views, self._actions = form, reviews, views, actions
        self._version = number_said(said(form, "version"))

    def do(self, action: str) -> bool:
        """Do it; True when the review is over with it. Raises Problem `bad-request`."""
        deeds: dict[str, Callable[[], bool]] = {
            "look": self._look,
            "move": self._move,
            "undo": self._undo,
            "sign": self._sign,
            "back": self._give_back,
            "unusable": self._mark_unusable,
            "run": self._run_again,
        }
        if action not in deeds:
            raise Problem("bad-request", "There is no such button.")
        return deeds[action]()

    def _area(self) -> AreaName:
        name = next((one for one in AREA_NAMES if one == said(self._form, "area")), None)
        if name is None:
            raise Problem("bad-request", "There is no such area.")
        return name

    def _look(self) -> bool:
        name = self._area()
        if not self._views.is_watched(self.case.id, self.by, said(self._form, "window")):
            raise _NotInThePicture
        self._views.look(self.case.id, self.by, name)
        self._reviews.look(self.by, self.case.id, self._version, name)
        return False

    def _move(self) -> bool:
        landmark = next((one for one in LANDMARK_NAMES if one == said(self._form, "landmark")), None)
        name = landmark or self._area()
        left, up = (number_said(said(self._form, way)) for way in ("left_mm", "up_mm"))
        place = self._views.nudge(self.case, self.by, name, left, up)
        if landmark is not None:
            self._reviews.move_landmark(self.by, self.case.id, self._version, landmark, place)
        else:
            self._reviews.move(self.by, self.case.id, self._version, self._area(), place)
        return False

    def _undo(self) -> bool:
        self._reviews.undo(self.by, self.case.id, self._version)
        return False

    def _sign(self) -> bool:
        self._reviews.sign(self.by, self.case.id, self._version)
        return True

    def _give_back(self) -> bool:
        decision = self._decision(RETURN_REASONS)
        self._reviews.give_back(self.by, self.case.id, self._version, decision)
        return True

    def _mark_unusable(self) -> bool:
        decision = self._decision(UNUSABLE_REASONS)
        self._reviews.mark_unusable(self.by, self.case.id, self._version, decision)
        return True

    def _run_again(self) -> bool:
        self._actions.run_again(self.by, self.case.id, self._version)
        return True

    def _decision(self, reasons: Mapping[str, Reason]) -> Decision:
        code = said(self._form, "reason")
        if code not in reasons:
            raise Problem("bad-request", "There is no such reason.")
        return Decision(code, said(self._form, "note"))


def number_said(text: str) -> int:
    """A whole number out of a form. Raises Problem `bad-request`."""
    try:
        return int(text)
    except ValueError as error:
        raise Problem("bad-request", "There is a number missing.") from error


def _stand(case: Case, by: Reviewer, files: FileVault, reviews: Reviews, current: str = "") -> Stand | None:
    """How the case stands for this clinician; None when there is no result to see."""
    if case.status not in HAS_RESULT:
        return None
    try:
        outcome = outcome_from_bytes(files.read(case.id, "outcome.npz"))
    except FileNotFound:
        return None
    found = reviews.read(by.actor, case.id)
    name = next((one for one in AREA_NAMES if one == current), None)
    return Stand(case, outcome, with_corrections(outcome, found), found, by, name)


def _panel_facts(request: Request, stand: Stand) -> dict[str, Any]:
    words = ReviewWords(request, stand)
    is_open = stand.case.status == "in_review"
    return {
        "areas": words.areas(),
        "upcoming": words.upcoming(),
        "landmarks": words.landmarks(),
        "has_moved_landmarks": bool(stand.review.landmarks),
        "can_undo": stand.review.last_move is not None,
        "is_open": is_open,
        "decision": words.decision(),
        "choices": decline_choices(gettext_of(request)),
        "version": stand.review.version,
        "current": stand.current or "",
    }


def _fragments(
    request: Request, case: Case, session: ClinicianDep, files: FileVault, reviews: Reviews, current: str
) -> JSONResponse:
    stand = _stand(case, reviewer(session), files, reviews, current)
    if stand is None:
        return JSONResponse({"next": f"/desk/cases/{case.id}"})
    facts = _panel_facts(request, stand) | {"case_id": case.id}
    page = render_part(request, "clinician/review/panel.html", session, **facts)
    return JSONResponse({"panel": page, "version": stand.review.version})
