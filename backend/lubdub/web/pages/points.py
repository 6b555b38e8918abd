"""Placing the landmarks: the page, its pieces for the script, its stream, and every button on it."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator, Callable
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Request
from fastapi.responses import JSONResponse, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from lubdub.cases.states import TAKES_LANDMARKS
from lubdub.cases.store import Asked
from lubdub.cases.values import Case
from lubdub.marking import look_over
from lubdub.results import BONE_LANDMARKS, LANDMARK_NAMES, LandmarkName, Patient
from lubdub.views.placing import MissedTheBody, NotOneViewer
from lubdub.views.turning import TURNS, Turn
from lubdub.web.deps import ActionsDep, CaseDep, FamilyDep, FormGuard
from lubdub.web.pages.common import STEP_OF, DeskDep, FormDep, asked_of, go, go_or_tell, next_path, said, wants_json
from lubdub.web.pages.feel import is_to_be_taught
from lubdub.web.pages.look import gettext_of, render, render_part
from lubdub.web.pages.marks import Marks
from lubdub.web.pages.points_words import PointsWords
from lubdub.web.problems import Problem
from lubdub.web.view import WindowName
from lubdub.web.view_desk import ViewDesk

POLL_S = 0.2
KEEP_ALIVE_POLLS = 25
MOST_STEPS = 20

router = APIRouter(include_in_schema=False)


def _markable(request: Request, case: CaseDep, desk: DeskDep) -> Case:
    if case.status not in TAKES_LANDMARKS or not case.is_checked:
        _ = gettext_of(request)
        raise Problem("point-not-placed", _("Points cannot be placed right now."))
    return case


MarkableDep = Annotated[Case, Depends(_markable)]


@router.get("/cases/{case_id}/points")
def points(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep) -> Response:
    """The live body and what to mark on it."""
    marks = desk.marks(case.id)
    if case.status not in TAKES_LANDMARKS or not case.is_checked:
        return go(next_path(case, marks))
    if not marks.sides_confirmed:
        return go(f"/cases/{case.id}/size")
    if is_to_be_taught(marks, case.person):
        return go(f"/cases/{case.id}/feel")
    return _page(request, case, family, desk)


@router.get("/cases/{case_id}/points/panel")
def panel(request: Request, case: MarkableDep, family: FamilyDep, desk: DeskDep) -> JSONResponse:
    """The words beside the view, as they are now."""
    return _fragments(request, case, family, desk)


@router.get("/cases/{case_id}/points/live", response_class=EventSourceResponse)
async def live(
    request: Request, case: MarkableDep, desk: DeskDep, window: WindowName = ""
) -> AsyncIterator[ServerSentEvent]:
    """Tells the page when a point changed and whether its own window of the view is connected."""
    told: tuple[str, bool] | None = None
    silent = 0
    snapshot = await run_in_threadpool(desk.snapshot, case.id)
    with desk.listening(case.id, snapshot) as last_seen:
        while not request.app.state.is_stopping():
            snapshot = last_seen()
            if snapshot is None or snapshot.owner != case.owner_session_id:
                return  # deleted, or handed to another browser
            now = (snapshot.version("marks.json"), desk.is_watched(case.id, window))
            if now != told or silent >= KEEP_ALIVE_POLLS:
                told, silent = now, 0
                yield ServerSentEvent(event="marks", data={"version": now[0], "connected": now[1]}, retry=1000)
            silent += 1
            await asyncio.sleep(POLL_S)


@router.post("/cases/{case_id}/points", dependencies=[FormGuard])
def act(
    request: Request, case: MarkableDep, family: FamilyDep, form: FormDep, desk: DeskDep, actions: ActionsDep
) -> Response:
    """One button."""
    action = said(form, "action")
    if action == "done":
        marks = desk.marks(case.id)
        if _marks_words(request, case, desk).stop() is not None:
            return _not_yet(request, case, family, desk)
        landmarks = {name: list(place) for name, place in marks.placed.items()}
        actions.place_landmarks(family.actor, case.id, Asked(landmarks=landmarks))
        return go_or_tell(request, f"/cases/{case.id}/waiting")
    if action in ("place", "slide"):
        _aim(request, case, desk, form)
    else:
        desk.change(case.id, change_for(action, said(form, "name"), case, desk))
    if wants_json(request):
        return _fragments(request, case, family, desk)
    return go(f"/cases/{case.id}/points")


def _page(request: Request, case: Case, family: FamilyDep, desk: ViewDesk, status: int = 200) -> Response:
    facts = _facts(request, case, desk) | {"step": STEP_OF["points"], "window": secrets.token_hex(4)}
    facts["is_stopped"] = status != 200
    back = f"/cases/{case.id}/size"
    return render(request, "family/points/points.html", family, status, back=back, **facts)


def _not_yet(request: Request, case: Case, family: FamilyDep, desk: ViewDesk) -> Response:
    """The run would only refuse these points: what to mend first, and nothing is lost."""
    if wants_json(request):
        said = _marks_words(request, case, desk).stop()
        raise Problem("point-not-placed", said or "")
    return _page(request, case, family, desk, 409)


def change_for(action: str, name: str, case: Case, desk: ViewDesk) -> Callable[[Marks], Marks]:
    """What a button does to the marks. Raises Problem `bad-request`."""
    asked = asked_of(case)
    if action == "choose" and name in LANDMARK_NAMES:
        chosen: LandmarkName = name
        return lambda marks: marks.choosing(chosen)
    if action in TURNS:
        way: Turn = next(turn for turn in TURNS if turn == action)
        return lambda marks: marks.turned(way)
    if action == "accept":
        return lambda marks: accepting(marks, case, desk)
    changes: dict[str, Callable[[Marks], Marks]] = {
        "skip": lambda marks: marks.skipping(asked),
        "next": lambda marks: marks.onward(asked),
        "undo": Marks.undone,
    }
    if action not in changes:
        raise Problem("bad-request", "There is no such button.")
    return changes[action]


def accepting(marks: Marks, case: Case, desk: ViewDesk) -> Marks:
    """The suggestion is right. What the eye can confirm counts as placed; a bone nobody felt stays a suggestion."""
    examination = desk.examination(case.id)
    asked = asked_of(case)
    name = next((one for one in examination.suggested if one == marks.target), None)
    if name is None or name in BONE_LANDMARKS:
        return marks.keeping(asked)
    in_file = examination.scan.body_from_file.inverse().apply(examination.suggested[name].position)
    return marks.with_placed(name, in_file.tolist()).onward(asked)


def _aim(request: Request, case: Case, desk: ViewDesk, form: FormDep) -> None:
    """Places the point at the crosshair, or slides the body under it."""
    _ = gettext_of(request)
    running = desk.running(case.id)
    try:
        if running is None:
            raise NotOneViewer
        if said(form, "action") == "place":
            running.content.view.place_at_crosshair()
        else:
            running.content.view.slide(steps(said(form, "right")), steps(said(form, "up")))
    except NotOneViewer as error:
        message = _("The picture is not ready, or it is open in two windows. Use one window and try again.")
        raise Problem("point-not-placed", message) from error
    except MissedTheBody as error:
        raise Problem("point-not-placed", _("The crosshair is not on the body. Turn or move it first.")) from error


def steps(text: str) -> int:
    """How many steps of the crosshair a script asks for; 0 for anything else."""
    try:
        return max(-MOST_STEPS, min(MOST_STEPS, int(text)))
    except ValueError:
        return 0


def _marks_words(request: Request, case: Case, desk: ViewDesk) -> PointsWords:
    marks, examination = desk.marks(case.id), desk.examination(case.id)
    in_file = {name: np.asarray(marks.placed[name], float) for name in LANDMARK_NAMES if name in marks.placed}
    patient = Patient(case.age_years, case.sex, case.posture)
    odd = look_over(examination, in_file, patient)
    return PointsWords(request, examination, marks, asked_of(case), odd)


def _facts(request: Request, case: Case, desk: ViewDesk) -> dict[str, Any]:
    snapshot = desk.snapshot(case.id)  # before the marks: what changes meanwhile is then told of once more
    marks = desk.marks(case.id)
    words = _marks_words(request, case, desk)
    return {
        "case_id": case.id,
        "points": words.all_points(),
        "current": words.current(),
        "can_undo": bool(marks.past),
        "summary": words.summary(),
        "odd": words.odd(),
        "stop": words.stop(),
        "mend": words.mend(),
        "is_unclear": words.is_unclear,
        "is_ready": all(marks.is_answered(name) for name in asked_of(case)),
        "version": "" if snapshot is None else snapshot.version("marks.json"),
    }


def _fragments(request: Request, case: Case, family: FamilyDep, desk: ViewDesk) -> JSONResponse:
    facts = _facts(request, case, desk)
    pieces = {
        piece: render_part(request, f"family/points/{piece}.html", family, **facts)
        for piece in ("ask", "actions", "list")
    }
    return JSONResponse({**pieces, "version": facts["version"]})
