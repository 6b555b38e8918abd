"""Waiting: while a scan is checked, and while the places are found. One may leave and come back."""

from __future__ import annotations

import math

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response

from lubdub.cases.clock import now
from lubdub.cases.states import IN_WORK
from lubdub.cases.store import Standing
from lubdub.cases.values import Case
from lubdub.web.deps import ActionsDep, CaseDep, FamilyDep, FormGuard, StoreDep
from lubdub.web.languages import language_of, words_of
from lubdub.web.pages.common import STEP_OF, DeskDep, go, next_path
from lubdub.web.pages.look import gettext_of, render

SURE_FROM = 0.15
"""Share of the work after which its speed says something."""
STEP_S = 10
LONG_S = 60.0
"""A sample takes 5 s, a large scan 20 s on a small machine."""

router = APIRouter(include_in_schema=False)


@router.get("/cases/{case_id}/checking")
@router.get("/cases/{case_id}/waiting")
def working(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep, store: StoreDep) -> Response:
    """What is being done, live. Without scripts the page loads itself again."""
    path = next_path(case, desk.marks(case.id))
    if case.status not in IN_WORK or request.url.path != path:
        return go(path)
    _ = gettext_of(request)
    is_check = case.status == "checking"
    return render(
        request,
        "family/checking/checking.html",
        family,
        case_id=case.id,
        heading=_("Looking at the scan") if is_check else _("Finding the four places"),
        lead=_("We check whether it shows a chest, and how big it is.")
        if is_check
        else _("We bend a reference body onto this chest and carry its four places over."),
        stage=stage_words(request, case),
        left=time_words(request, case, store.standing(family.actor, case.id)),
        fraction=case.fraction,
        step=STEP_OF["scan" if is_check else "result"],
    )


@router.get("/cases/{case_id}/state")
def state(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep, store: StoreDep) -> JSONResponse:
    """The same in short, for the page's script."""
    standing = store.standing(family.actor, case.id)
    return JSONResponse(
        {
            "stage": stage_words(request, case),
            "left": time_words(request, case, standing),
            "fraction": case.fraction,
            "next": next_path(case, desk.marks(case.id)),
        }
    )


@router.post("/cases/{case_id}/cancel", dependencies=[FormGuard])
def cancelled(case: CaseDep, family: FamilyDep, actions: ActionsDep) -> Response:
    """Stops the work; the case steps back."""
    if case.status in IN_WORK:
        actions.cancel(family.actor, case.id)
    return go(f"/cases/{case.id}")


def stage_words(request: Request, case: Case) -> str:
    """The stage in a few plain words."""
    _ = gettext_of(request)
    if case.status == "queued":
        return _("Waiting for our turn")
    words = {
        "read": _("Reading the file"),
        "clean": _("Finding the chest in the scan"),
        "fit": _("Bending a reference body onto it"),
        "choose": _("Comparing with reference bodies"),
        "project": _("Carrying the places over"),
        "judge": _("Checking whether we can be sure"),
    }
    return words.get(case.stage or "", _("Starting"))


def time_words(request: Request, case: Case, standing: Standing) -> str:
    """How long it may still take, roughly; or who is first; or nothing while that is not known."""
    _, ngettext = gettext_of(request), words_of(language_of(request)).ngettext
    if case.status not in IN_WORK:
        return ""
    gone = (now() - standing.since).total_seconds()
    if standing.ahead:
        said = ngettext("One other scan is before yours.", "{count} other scans are before yours.", standing.ahead)
        return said.format(count=standing.ahead)
    if gone > LONG_S:
        return _("This takes longer than usual. You can leave: the work goes on, and nothing is lost.")
    if case.fraction < SURE_FROM:
        return ""
    left = gone * (1 - case.fraction) / case.fraction
    if left < STEP_S:
        return _("Only a few seconds to go.")
    return _("About {seconds} seconds to go.").format(seconds=math.ceil(left / STEP_S) * STEP_S)
