"""REST: a case's life from opening to deletion."""

from __future__ import annotations

import hashlib
import json
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Header, Path, Query, Request, Response
from fastapi.security import HTTPBearer

from lubdub.cases.store import Asked, Repeatable
from lubdub.web.deps import ActionsDep, FilesDep, ReaderDep, StoreDep, WriterDep
from lubdub.web.schemas import CaseIn, CaseOut, LandmarksIn, ReceiptOut, UnitIn, problems
from lubdub.web.schemas_result import ExaminationOut

USUAL = problems("bad-request", "not-signed-in", "scope-missing", "cross-site", "case-not-found", "invalid-input")
USUAL |= problems("too-many-requests")
BEARER = HTTPBearer(auto_error=False, description="A portal's key: `Authorization: Bearer lubdub_...`")

router = APIRouter(tags=["cases"], dependencies=[Depends(BEARER)], responses=USUAL)

UnitQuery = Annotated[Literal["m", "cm", "mm"] | None, Query(description="Unit of the file; found when not said.")]
MethodQuery = Annotated[Literal["lubdub", "paper", "rule"], Query(description="Which method places the areas.")]
IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        description="Any text of your own. The same call with the same key opens one case, for 24 hours.",
    ),
]
CaseId = Annotated[str, Path(max_length=64, description="The case's id, as it was given when the case was opened.")]


async def _body_sha256(request: Request) -> str:
    return hashlib.sha256(await request.body()).hexdigest()


@router.post("/cases", status_code=201, responses=problems("too-large", "idempotency-mismatch", "invalid-input"))
def open_case(
    new: CaseIn,
    actor: WriterDep,
    actions: ActionsDep,
    response: Response,
    body_sha256: Annotated[str, Depends(_body_sha256)],
    idempotency_key: IdempotencyKey = None,
) -> CaseOut:
    """Open a case. A yes to a stop question makes it `refused` at once, with the reason."""
    repeatable = None if idempotency_key is None else Repeatable(idempotency_key, body_sha256)
    case, _ = actions.open(actor, new.to_value(), repeatable)
    shown = CaseOut.of(case)
    response.headers["Location"] = shown.links["self"]
    return shown


@router.get("/cases/{case_id}")
def read_case(case_id: CaseId, actor: ReaderDep, store: StoreDep) -> CaseOut:
    """How the case stands."""
    return CaseOut.of(store.get(actor, case_id))


@router.put(
    "/cases/{case_id}/scan",
    status_code=202,
    responses=problems("too-large", "state-conflict", "empty-body", "invalid-input"),
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


@router.get("/cases/{case_id}/scan", responses=problems("file-not-ready") | EXAMINATION)
def read_examination(case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep) -> dict[str, Any]:
    """What was found on the scan: unit, frame, size, coverage, warnings, suggested landmarks."""
    store.get(actor, case_id)
    return json.loads(files.read(case_id, "examination.json"))


@router.put("/cases/{case_id}/scan/unit", status_code=202, responses=problems("state-conflict"))
def correct_unit(case_id: CaseId, said: UnitIn, actor: WriterDep, actions: ActionsDep) -> CaseOut:
    """Say the unit when the one found is wrong; the scan is examined again."""
    return CaseOut.of(actions.check_again(actor, case_id, said.unit))


@router.put("/cases/{case_id}/landmarks", status_code=202, responses=problems("state-conflict"))
def place_landmarks(
    case_id: CaseId,
    placed: LandmarksIn,
    actor: WriterDep,
    actions: ActionsDep,
    unit: UnitQuery = None,
    method: MethodQuery = "lubdub",
) -> CaseOut:
    """Give the landmarks and queue the run. Missing ones are suggested, and the result says so."""
    return CaseOut.of(actions.place_landmarks(actor, case_id, Asked(placed.placed(), unit, method)))


@router.post("/cases/{case_id}/landmarks/confirm", status_code=202, responses=problems("state-conflict"))
def confirm_landmarks(
    case_id: CaseId, actor: WriterDep, actions: ActionsDep, method: MethodQuery = "lubdub"
) -> CaseOut:
    """Queue the run with the suggested landmarks."""
    return CaseOut.of(actions.place_landmarks(actor, case_id, Asked({}, None, method)))


@router.post("/cases/{case_id}/cancel", responses=problems("state-conflict"))
def cancel(case_id: CaseId, actor: WriterDep, actions: ActionsDep) -> CaseOut:
    """Stop what is at work. The case waits again for what it waited for before."""
    return CaseOut.of(actions.cancel(actor, case_id))


@router.delete("/cases/{case_id}")
def delete_case(case_id: CaseId, actor: WriterDep, actions: ActionsDep) -> ReceiptOut:
    """Delete the case for good: its key is destroyed, its files go. Asked again, the receipt is the same."""
    return ReceiptOut.of(actions.delete(actor, case_id))
