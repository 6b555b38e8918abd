"""Where a case stands on the family's way through the pages, and what every step shares."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request
from fastapi.responses import JSONResponse, RedirectResponse, Response
from starlette.datastructures import FormData

from lubdub.cases.values import Case
from lubdub.results import PUBERTY_YEARS, LandmarkName
from lubdub.web.pages_marks import Marks, asked_points
from lubdub.web.view_desk import ViewDesk

STEP_OF = {"who": 1, "scan": 2, "size": 3, "points": 4, "result": 5}


async def _form(request: Request) -> FormData:
    return await request.form()


FormDep = Annotated[FormData, Depends(_form)]


def _desk(request: Request) -> ViewDesk:
    desk: ViewDesk = request.app.state.views
    return desk


DeskDep = Annotated[ViewDesk, Depends(_desk)]


def said(form: FormData, name: str) -> str:
    """A field's text, trimmed; empty for what is missing or a file."""
    value = form.get(name)
    return value.strip() if isinstance(value, str) else ""


def next_path(case: Case, marks: Marks) -> str:
    """The page a case belongs on now."""
    step = {
        "awaiting_scan": "scan",
        "checking": "checking",
        "queued": "waiting",
        "running": "waiting",
        "done": "result",
        "refused": "refused",
        "failed": "refused",
        "deleted": "removed",
        "awaiting_landmarks": "points" if marks.sides_confirmed else "size",
    }[case.status]
    return f"/cases/{case.id}/{step}"


def asked_of(case: Case) -> tuple[LandmarkName, ...]:
    """The points asked for this patient."""
    return asked_points(case.sex, case.age_years, PUBERTY_YEARS)


def go(path: str) -> RedirectResponse:
    """On to another page, by GET."""
    return RedirectResponse(path, 303)


def wants_json(request: Request) -> bool:
    """Whether a script of ours asks."""
    return request.headers.get("accept", "").startswith("application/json")


def go_or_tell(request: Request, path: str) -> Response:
    """On to another page, told to a script or done by the browser."""
    return JSONResponse({"next": path}) if wants_json(request) else go(path)
