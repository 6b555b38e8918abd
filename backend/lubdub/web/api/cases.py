"""REST: a case's life from opening to deletion."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Path, Query, Request, Response

from lubdub.cases.listing import Wanted
from lubdub.cases.states import Status
from lubdub.cases.store import Asked
from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import (
    BEARER,
    ActionsDep,
    FilesDep,
    ListingDep,
    ReaderDep,
    SettingsDep,
    StaffDep,
    StoreDep,
    WriterDep,
)
from lubdub.web.problems import Problem
from lubdub.web.repeating import RepeatableDep
from lubdub.web.reviewers import reviewer_name
from lubdub.web.schemas import CaseIn, CaseOut, CasesOut, LandmarksIn, ReceiptOut, UnitIn, problems
from lubdub.web.schemas_result import ExaminationOut

USUAL = problems("bad-request", "not-signed-in", "scope-missing", "cross-site", "case-not-found", "invalid-input")
USUAL |= problems("too-many-requests")

router = APIRouter(tags=["cases"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)

UnitQuery = Annotated[Literal["m", "cm", "mm"] | None, Query(description="Unit of the file; found when not said.")]
MethodQuery = Annotated[Literal["lubdub", "paper", "rule"], Query(description="Which method places the areas.")]
RUN_REFUSED = problems("state-conflict", "idempotency-mismatch", "invalid-input")
REFUSED_SCAN = ("scope-missing", "cross-site", "sandbox-takes-samples")
CaseId = Annotated[str, Path(max_length=64, description="The case's id, as it was given when the case was opened.")]


@router.post(
    "/cases",
    status_code=201,
    responses=problems("too-large", "idempotency-mismatch", "invalid-input", "consent-missing"),
)
def open_case(
    new: CaseIn, actor: WriterDep, actions: ActionsDep, response: Response, repeatable: RepeatableDep
) -> CaseOut:
    """Open a case. A yes to a stop question makes it `refused` at once, with the reason."""
    asked = new.to_value()
    if actor.is_sandbox:
        asked = replace(asked, person="sample")
    if actor.kind == "family":
        asked = replace(asked, consent=None)  # families agree on the page that tells them what to
    case, _ = actions.open(actor, asked, repeatable)
    shown = CaseOut.of(case)
    response.headers["Location"] = shown.links["self"]
    return shown


@router.get("/cases", responses=UNCHANGED)
def list_cases(
    request: Request,
    actor: ReaderDep,
    listing: ListingDep,
    response: Response,
    limit: Annotated[int, Query(ge=1, le=100, description="At most so many.")] = 50,
    cursor: Annotated[str | None, Query(max_length=200, description="`next_cursor` of the page before.")] = None,
    status: Annotated[Status | None, Query(description="Only cases in this state.")] = None,
    external_id: Annotated[str | None, Query(max_length=200, description="Only cases with this number.")] = None,
) -> CasesOut:
    """Your cases, newest first, page by page. The header `Link` (RFC 8288) leads to the next page, too."""
    page = listing.page(actor, Wanted(limit, cursor, status, external_id))
    if page.next_cursor is not None:
        query = urlencode(dict(request.query_params) | {"cursor": page.next_cursor})
        response.headers["Link"] = f'<{request.url.path}?{query}>; rel="next"'
    return CasesOut(items=[CaseOut.of(case) for case in page.cases], next_cursor=page.next_cursor)


@router.get("/cases/{case_id}", responses=UNCHANGED)
def read_case(case_id: CaseId, actor: ReaderDep, store: StoreDep) -> CaseOut:
    """How the case stands."""
    return CaseOut.of(store.get(actor, case_id))


@router.put(
    "/cases/{case_id}/scan",
    status_code=202,
    responses=problems("too-large", "upload-quota", "state-conflict", "empty-body", "invalid-input", *REFUSED_SCAN),
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def send_scan(
    case_id: CaseId, request: Request, actor: WriterDep, actions: ActionsDep, unit: UnitQuery = None
) -> CaseOut:
    """Send the scan's file as the raw body: PLY, STL, OBJ, zip, GLB, PCD, XYZ. It is examined at once."""
    return CaseOut.of(await actions.receive_scan(actor, case_id, request.stream(), unit))


EXAMINATION: dict[int | str, dict[str, Any]] = {200: {"model": ExaminationOut, "description": "What was found."}}


@router.get("/cases/{case_id}/scan", responses=problems("case-not-found", "file-not-ready") | EXAMINATION | UNCHANGED)
def read_examination(case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep) -> dict[str, Any]:
    """What was found on the scan: unit, frame, size, coverage, warnings, suggested landmarks."""
    store.get(actor, case_id)
    return json.loads(files.read(case_id, "examination.json"))


@router.put("/cases/{case_id}/scan/unit", status_code=202, responses=problems("state-conflict"))
def correct_unit(case_id: CaseId, said: UnitIn, actor: WriterDep, actions: ActionsDep) -> CaseOut:
    """Say the unit when the one found is wrong; the scan is examined again."""
    return CaseOut.of(actions.check_again(actor, case_id, said.unit))


@router.put("/cases/{case_id}/landmarks", status_code=202, responses=RUN_REFUSED)
def place_landmarks(
    case_id: CaseId,
    placed: LandmarksIn,
    actor: WriterDep,
    actions: ActionsDep,
    repeatable: RepeatableDep,
    unit: UnitQuery = None,
    method: MethodQuery = "lubdub",
) -> CaseOut:
    """Give the landmarks and queue the run. Missing ones are suggested, and the result says so."""
    return CaseOut.of(actions.place_landmarks(actor, case_id, Asked(placed.placed(), unit, method), repeatable))


@router.post("/cases/{case_id}/landmarks/confirm", status_code=202, responses=RUN_REFUSED)
def confirm_landmarks(
    case_id: CaseId, actor: WriterDep, actions: ActionsDep, repeatable: RepeatableDep, method: MethodQuery = "lubdub"
) -> CaseOut:
    """Queue the run with the suggested landmarks."""
    return CaseOut.of(actions.place_landmarks(actor, case_id, Asked({}, None, method), repeatable))


@router.post("/cases/{case_id}/review", responses=problems("state-conflict"))
def send_for_review(
    case_id: CaseId, actor: WriterDep, store: StoreDep, staff: StaffDep, settings: SettingsDep
) -> CaseOut:
    """Hand the result to the clinicians of the organisation. Sent twice, it was sent once."""
    case = store.get(actor, case_id)
    if actor.kind == "family" and not reviewer_name(case, staff, settings):
        raise Problem("state-conflict", "No clinician is connected to this service.")
    return CaseOut.of(store.send_for_review(actor, case_id))


@router.delete("/cases/{case_id}/review", responses=problems("state-conflict"))
def take_back(case_id: CaseId, actor: WriterDep, store: StoreDep) -> CaseOut:
    """Take it back before a clinician has decided, so that points or scan can be changed."""
    return CaseOut.of(store.take_back(actor, case_id))


@router.post("/cases/{case_id}/cancel", responses=problems("state-conflict"))
def cancel_case(case_id: CaseId, actor: WriterDep, actions: ActionsDep) -> CaseOut:
    """Stop what is at work. The case waits again for what it waited for before."""
    return CaseOut.of(actions.cancel(actor, case_id))


@router.delete("/cases/{case_id}", responses=problems("state-conflict"))
def delete_case(case_id: CaseId, actor: WriterDep, actions: ActionsDep) -> ReceiptOut:
    """Delete the case for good: its key is destroyed, its files go. Asked again, the receipt is the same."""
    return ReceiptOut.of(actions.delete(actor, case_id))
