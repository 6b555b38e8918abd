"""The result, or the reason why there is none; and deleting it all."""

from __future__ import annotations

from datetime import UTC
from typing import Any

from babel.dates import format_datetime
from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, Response

from lubdub.cases.errors import CaseHeld
from lubdub.cases.files import FileVault
from lubdub.cases.review import Reviews
from lubdub.cases.states import HAS_RESULT, TURNED_DOWN
from lubdub.cases.values import Actor, Case
from lubdub.results import UNREADABLE_FILE
from lubdub.web.api.results import VIEW_POLICY, picture_of, result_of
from lubdub.web.deps import (
    ActionsDep,
    CaseDep,
    FamilyDep,
    FilesDep,
    FormGuard,
    ReviewsDep,
    ServicesDep,
    SettingsDep,
    StaffDep,
    StoreDep,
)
from lubdub.web.languages import language_of
from lubdub.web.pages.common import STEP_OF, DeskDep, FormDep, go, next_path, said
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.pages.result_words import ResultWords
from lubdub.web.problems import Problem
from lubdub.web.reviewed import shown_outcome
from lubdub.web.reviewers import reviewer_name

NEEDS_A_SCAN = frozenset(
    (
        *("area_not_scanned", "chest_not_in_scan", "chest_not_matched"),
        *("fit_failed", "looks_like_a_back", "posture_sitting_breasts"),
    )
)
"""Codes of the refusals whose first advice is another scan."""

UNIT_ASKED = "unit_implausible"
"""Code of the refusal that a word about the file's unit may mend."""

router = APIRouter(include_in_schema=False)


@router.get("/cases/{case_id}/result")
def result(
    request: Request,
    case: CaseDep,
    family: FamilyDep,
    desk: DeskDep,
    files: FilesDep,
    reviews: ReviewsDep,
    settings: SettingsDep,
    staff: StaffDep,
) -> Response:
    """The four places: in 3D, in words, and what to make of them."""
    if case.status not in HAS_RESULT:
        return go(next_path(case, desk.marks(case.id)))
    outcome, review = shown_outcome(case, family.actor, files, reviews)
    _ = gettext_of(request)
    clinic = reviewer_name(case, staff, settings)
    words = ResultWords(request, case, outcome, review)
    return render(
        request,
        "family/result/result.html",
        family,
        case_id=case.id,
        heading=words.heading(),
        lead=words.lead(),
        whose=words.whose(),
        checked=words.checked(),
        can_share=case.status == "reviewed" and case.person != "sample",
        is_shared=case.is_shared,
        reasons=words.reasons(),
        found=words.places(),
        facts=words.facts(),
        how=words.how(),
        not_words=words.not_diagnosis(),
        ring_words=words.ring(),
        clinic=clinic,
        sent_to=(clinic or _("your clinician")) if case.status == "in_review" else "",
        step=STEP_OF["result"],
        back="" if case.is_sent else f"/cases/{case.id}/points",
    )


@router.get("/cases/{case_id}/picture", response_class=HTMLResponse)
def picture(
    request: Request, case: CaseDep, family: FamilyDep, files: FilesDep, store: StoreDep, reviews: ReviewsDep
) -> HTMLResponse:
    """The bare 3D picture, for the frame of the result's page."""
    read = store.note_reading(family.actor, case.id, "view.read")
    page = picture_of(request, read, family.actor, files, reviews)
    return HTMLResponse(page, headers={"Content-Security-Policy": VIEW_POLICY})


@router.post("/cases/{case_id}/send", dependencies=[FormGuard])
def send(case: CaseDep, family: FamilyDep, store: StoreDep, staff: StaffDep, settings: SettingsDep) -> Response:
    """Hands the result to the clinician this service names; without one, nothing is sent and nothing is said to be."""
    if not reviewer_name(case, staff, settings):
        raise Problem("state-conflict", "No clinician is connected to this service. Save or print the sheet instead.")
    store.send_for_review(family.actor, case.id)
    return go(f"/cases/{case.id}/result")


@router.post("/cases/{case_id}/take-back", dependencies=[FormGuard])
def taken_back(case: CaseDep, family: FamilyDep, store: StoreDep) -> Response:
    """Undoes the sending."""
    store.take_back(family.actor, case.id)
    return go(f"/cases/{case.id}/result")


@router.post("/cases/{case_id}/share", dependencies=[FormGuard])
def shared(request: Request, case: CaseDep, family: FamilyDep, held: ServicesDep, form: FormDep) -> Response:
    """The separate yes to keeping the shape for others, or taking it back."""
    if said(form, "share") == "yes":
        held.sharing.agree(family.actor, case.id, language_of(request))
    else:
        held.sharing.take_back(family.actor, case.id)
    return go(f"/cases/{case.id}/result#share-shape")


@router.get("/cases/{case_id}/refused")
def refused(
    request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep, files: FilesDep, reviews: ReviewsDep
) -> Response:
    """One reason and one thing to do: ours, or the clinician's."""
    if case.status not in (*TURNED_DOWN, "failed"):
        return go(next_path(case, desk.marks(case.id)))
    _ = gettext_of(request)
    document = _document(case, family.actor, files, reviews)
    said = [one | {word: _(one[word]) for word in ("message", "advice")} for one in document["reasons"]]
    is_ours = case.status == "failed" or not said
    said = said or [{"message": _("The work stopped before it ended."), "advice": _("Please try again.")}]
    code = said[0].get("code")
    closing = _("A wrong place that looks right would help nobody, so we show none. Nothing you gave us is lost.")
    return render(
        request,
        "family/refused/refused.html",
        family,
        case_id=case.id,
        heading=_("Something went wrong on our side") if is_ours else _refused_heading(request, case, code),
        reason=said[0],
        others=said[1:],
        review=document.get("review"),
        closing=_("Nothing you gave us is lost.") if code == UNREADABLE_FILE else closing,
        actions=_ways_on(request, case, code),
        units=_unit_words(request) if code == UNIT_ASKED and case.has_scan else {},
        step=STEP_OF["result"] if case.is_checked else STEP_OF["scan"],
    )


@router.get("/cases/{case_id}/remove")
def remove(request: Request, case: CaseDep, family: FamilyDep) -> Response:
    """Asks once more, or says why it cannot be done yet."""
    page = "family/remove/held.html" if case.is_held else "family/remove/remove.html"
    return render(request, page, family, case_id=case.id, is_gone=True)


@router.post("/cases/{case_id}/remove", dependencies=[FormGuard])
def delete(case_id: str, family: FamilyDep, actions: ActionsDep, desk: DeskDep) -> Response:
    """Deletes for good, and on to the receipt; back to the question when a hold is on the case, which says so."""
    try:
        actions.delete(family.actor, case_id)
    except CaseHeld:
        return go(f"/cases/{case_id}/remove")
    desk.close(case_id)
    return go(f"/cases/{case_id}/removed")


@router.get("/cases/{case_id}/removed")
def removed(request: Request, case_id: str, family: FamilyDep, actions: ActionsDep) -> Response:
    """The receipt, for who opened the case, as often as the page is loaded."""
    receipt = actions.receipt(family.actor, case_id)
    if receipt is None:
        return go(f"/cases/{case_id}")
    return render(
        request,
        "family/removed/removed.html",
        receipt=receipt,
        deleted_at=format_datetime(receipt.deleted_at, "long", tzinfo=UTC, locale=language_of(request)),
    )


def _document(case: Case, actor: Actor, files: FileVault, reviews: Reviews) -> dict[str, Any]:
    if case.status == "failed":
        return {"reasons": [] if case.reason is None else [dict(case.reason)]}
    return result_of(case, actor, files, reviews)


def _refused_heading(request: Request, case: Case, code: str | None) -> str:
    _ = gettext_of(request)
    headings = {
        "returned": _("Your clinician asks you to do this again"),
        "unusable": _("Your clinician says: do not use these places"),
    }
    ours = _("We could not read this file") if code == UNREADABLE_FILE else _("We do not show places for this scan")
    return headings.get(case.status, ours)


def _unit_words(request: Request) -> dict[str, str]:
    """Unit -> what it is called."""
    _ = gettext_of(request)
    return {"m": _("Metres (m)"), "cm": _("Centimetres (cm)"), "mm": _("Millimetres (mm)")}


def _ways_on(request: Request, case: Case, code: str | None) -> list[dict[str, str]]:
    """What can be done next, first what the reason of this code asks for."""
    _ = gettext_of(request)
    if not case.has_scan or case.status == "unusable":
        return [{"href": "/", "words": _("To the start page")}]
    ways = [{"href": f"/cases/{case.id}/scan", "words": _("Send another scan")}]
    if case.is_checked:
        points = {"href": f"/cases/{case.id}/points", "words": _("Look at the points again")}
        ways.insert(1 if code in NEEDS_A_SCAN else 0, points)
    return ways
