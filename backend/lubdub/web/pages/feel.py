"""Teaching the two bone points, before the first of them is asked for."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.states import TAKES_LANDMARKS
from lubdub.results import BONE_LANDMARKS
from lubdub.web.deps import CaseDep, FamilyDep, FormGuard
from lubdub.web.pages.common import STEP_OF, DeskDep, go, next_path
from lubdub.web.pages.look import render
from lubdub.web.pages.marks import Marks
from lubdub.web.pages.stickers import sheets_for

router = APIRouter(include_in_schema=False)


def is_to_be_taught(marks: Marks, person: str) -> bool:
    """Whether a bone is still to be felt by somebody to whom nobody has shown how. With a sample it is always shown."""
    is_marked = all(name in marks.placed for name in BONE_LANDMARKS)
    return not marks.is_taught and (person == "sample" or not is_marked)


@router.get("/cases/{case_id}/feel")
def feel(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep) -> Response:
    """What to feel for, in two drawings."""
    marks = desk.marks(case.id)
    if case.status not in TAKES_LANDMARKS or not marks.sides_confirmed:
        return go(next_path(case, marks))
    facts: dict[str, Any] = {"case_id": case.id, "sheets": sheets_for(case), "step": STEP_OF["points"]}
    return render(request, "family/points/feel.html", family, back=f"/cases/{case.id}/size", **facts)


@router.post("/cases/{case_id}/feel", dependencies=[FormGuard])
def felt(case: CaseDep, family: FamilyDep, desk: DeskDep) -> Response:
    """On to the points."""
    desk.change(case.id, Marks.taught)
    return go(f"/cases/{case.id}/points")
