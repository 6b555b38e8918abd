"""The result, or the reason why there is none; and deleting it all."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.cases.values import Case
from lubdub.report.archive import outcome_from_bytes
from lubdub.results import Outcome
from lubdub.web.api_results import result_of
from lubdub.web.deps import ActionsDep, CaseDep, FamilyDep, FilesDep, FormGuard
from lubdub.web.pages_common import STEP_OF, DeskDep, go, next_path
from lubdub.web.pages_look import gettext_of, render
from lubdub.web.pages_result_words import ResultWords

router = APIRouter(include_in_schema=False)


@router.get("/cases/{case_id}/result")
def result(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep, files: FilesDep) -> Response:
    """The four places: in 3D, in words, and what to make of them."""
    outcome = _outcome(case, files)
    if case.status != "done" or outcome is None or not outcome.areas:
        return go(next_path(case, desk.marks(case.id)))
    words = ResultWords(request, case, outcome)
    return render(
        request,
        "family/result/result.html",
        family,
        case_id=case.id,
        heading=words.heading(),
        lead=words.lead(),
        reasons=outcome.reasons,
        found=words.places(),
        facts=words.facts(),
        posture_words=words.posture(),
        step=STEP_OF["result"],
        back=f"/cases/{case.id}/points",
    )


@router.get("/cases/{case_id}/refused")
def refused(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep, files: FilesDep) -> Response:
    """One reason and one thing to do."""
    if case.status not in ("refused", "failed"):
        return go(next_path(case, desk.marks(case.id)))
    _ = gettext_of(request)
    said = _reasons(case, files)
    if case.status == "failed" or not said:
        heading = _("Something went wrong on our side")
        said = said or [{"message": _("The work stopped before it ended."), "advice": _("Please try again.")}]
    else:
        heading = _("We do not show places for this scan")
    return render(
        request,
        "family/refused/refused.html",
        family,
        case_id=case.id,
        heading=heading,
        reason=said[0],
        others=said[1:],
        closing=_("A wrong place that looks right would help nobody, so we show none. Nothing you gave us is lost."),
        actions=_ways_on(request, case),
        step=STEP_OF["result"] if case.is_checked else STEP_OF["scan"],
    )


@router.get("/cases/{case_id}/remove")
def remove(request: Request, case: CaseDep, family: FamilyDep) -> Response:
    """Asks once more."""
    return render(request, "family/remove/remove.html", family, case_id=case.id, is_gone=True)


@router.post("/cases/{case_id}/remove", dependencies=[FormGuard])
def removed(request: Request, case_id: str, family: FamilyDep, actions: ActionsDep, desk: DeskDep) -> Response:
    """Deletes for good and shows the receipt."""
    receipt = actions.delete(family.actor, case_id)
    desk.close(case_id)
    return render(
        request,
        "family/removed/removed.html",
        receipt=receipt,
        deleted_at=receipt.deleted_at.strftime("%Y-%m-%d %H:%M UTC"),
    )


def _outcome(case: Case, files: FileVault) -> Outcome | None:
    try:
        return outcome_from_bytes(files.read(case.id, "outcome.npz"))
    except FileNotFound:
        return None


def _reasons(case: Case, files: FileVault) -> list[dict[str, Any]]:
    if case.status == "failed":
        return [] if case.reason is None else [dict(case.reason)]
    return list(result_of(case, files)["reasons"])


def _ways_on(request: Request, case: Case) -> list[dict[str, str]]:
    _ = gettext_of(request)
    if not case.has_scan:
        return [{"href": "/", "words": _("To the start page")}]
    ways = [{"href": f"/cases/{case.id}/scan", "words": _("Send another scan")}]
    if case.is_checked:
        ways.insert(0, {"href": f"/cases/{case.id}/points", "words": _("Look at the points again")})
    return ways
