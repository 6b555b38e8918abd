"""Where a case stands on the family's way through the pages, and what every step shares."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request
from fastapi.responses import JSONResponse, RedirectResponse, Response
from starlette.datastructures import FormData

from lubdub.cases.values import Case
from lubdub.results import PUBERTY_YEARS, Examination, LandmarkName
from lubdub.web.pages.marks import Marks, asked_points
from lubdub.web.view_desk import ViewDesk

STEP_OF = {"who": 1, "consent": 2, "prepare": 3, "scan": 4, "size": 5, "points": 6, "result": 7}


async def _form(request: Request) -> FormData:
    return await request.form()


FormDep = Annotated[FormData, Depends(_form)]


def _desk(request: Request) -> ViewDesk:
    desk: ViewDesk = request.app.state.views
    return desk


DeskDep = Annotated[ViewDesk, Depends(_desk)]


def said(form: FormData, name: str) -> str:
    """A field's text, trimmed; empty for what is missing or a file."""
    return as_typed(form, name).strip()


def as_typed(form: FormData, name: str) -> str:
    """A field's text to the last sign, for passwords; empty for what is missing or a file."""
    value = form.get(name)
    return value if isinstance(value, str) else ""


def next_path(case: Case, marks: Marks) -> str:
    """The page a case belongs on now."""
    step = {
        "awaiting_scan": _preparing(case),
        "checking": "checking",
        "queued": "waiting",
        "running": "waiting",
        "done": "result",
        "in_review": "result",
        "reviewed": "result",
        "returned": "refused",
        "unusable": "refused",
        "refused": "refused",
        "failed": "refused",
        "deleted": "removed",
        "awaiting_landmarks": "points" if marks.sides_confirmed else "size",
    }[case.status]
    return f"/cases/{case.id}/{step}"


def _preparing(case: Case) -> str:
    if case.guide.is_read or case.has_scan:
        return "scan"
    return _instructions(case)


def _instructions(case: Case) -> str:
    return f"guide/{case.guide.app}" if case.guide.app else "guide"


def before_scan(case: Case) -> str:
    """The last page of the instructions; there is nothing to get ready for who has a file already."""
    if case.guide.app in (None, "file"):
        return f"/cases/{case.id}/{_instructions(case)}"
    return f"/cases/{case.id}/ready"


def asked_of(case: Case) -> tuple[LandmarkName, ...]:
    """The points asked for this patient."""
    return asked_points(case.sex, case.age_years, PUBERTY_YEARS)


def is_unclear(examination: Examination) -> bool:
    """Whether the scan's shape does not say which way the body lies, so that a person has to."""
    return any(warning.code == "lie_unclear" for warning in examination.warnings)


def go(path: str) -> RedirectResponse:
    """On to another page, by GET."""
    return RedirectResponse(path, 303)


def wants_json(request: Request) -> bool:
    """Whether a script of ours asks."""
    return request.headers.get("accept", "").startswith("application/json")


def go_or_tell(request: Request, path: str) -> Response:
    """On to another page, told to a script or done by the browser."""
    return JSONResponse({"next": path}) if wants_json(request) else go(path)
