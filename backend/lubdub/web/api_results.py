"""REST: what a case ends with."""

from __future__ import annotations

import json
import threading
from typing import Any

from fastapi import APIRouter, Depends
from fastapi.responses import HTMLResponse, StreamingResponse

from lubdub.cases.errors import FileNotFound, StateConflict
from lubdub.cases.files import FileVault
from lubdub.cases.values import Case
from lubdub.report.archive import outcome_from_bytes
from lubdub.views.export import STATIC_POLICY, result_html
from lubdub.web.api_cases import BEARER, USUAL, CaseId
from lubdub.web.deps import FilesDep, ReaderDep, StoreDep
from lubdub.web.schemas import problems
from lubdub.web.schemas_result import ResultOut

VIEW_POLICY = f"sandbox allow-scripts; {STATIC_POLICY}; frame-ancestors 'self'"
"""The 3D page carries its scripts inside; it runs without an origin of its own and can reach no server."""

router = APIRouter(tags=["results"], dependencies=[Depends(BEARER)], responses=USUAL)

_drawing = threading.Lock()


def result_of(case: Case, files: FileVault) -> dict[str, Any]:
    """The result document, also for a case that was refused before any run. Raises StateConflict before the end."""
    if case.status not in ("done", "refused"):
        raise StateConflict(f"There is no result while the case is {case.status.replace('_', ' ')}.")
    try:
        document: dict[str, Any] = json.loads(files.read(case.id, "result.json"))
    except FileNotFound:
        return {"verdict": "refuse", "reasons": [] if case.reason is None else [dict(case.reason)]}
    return document


def view_of(case: Case, files: FileVault) -> str:
    """The 3D page of the result, drawn once and then kept. Raises FileNotFound when there is nothing to show."""
    with _drawing:
        try:
            return files.read(case.id, "view.html").decode()
        except FileNotFound:
            return files.derive(case.id, "view.html", "outcome.npz", lambda outcome: _draw(outcome, case)).decode()


def _draw(outcome: bytes, case: Case) -> bytes:
    return result_html(outcome_from_bytes(outcome), case.age_years).encode()


RESULT: dict[int | str, dict[str, Any]] = {200: {"model": ResultOut, "description": "The result."}}


@router.get("/cases/{case_id}/result", responses=problems("state-conflict") | RESULT)
def read_result(case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep) -> dict[str, Any]:
    """The four areas, or the reason why none are shown; positions in the file's own coordinates and unit."""
    return result_of(store.note_reading(actor, case_id, "result.read"), files)


@router.get("/cases/{case_id}/view.html", response_class=HTMLResponse, responses=problems("file-not-ready"))
def read_view(case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep) -> HTMLResponse:
    """The result in 3D as one page that needs no connection. Show it in a sandboxed frame."""
    page = view_of(store.note_reading(actor, case_id, "view.read"), files)
    return HTMLResponse(page, headers={"Content-Security-Policy": VIEW_POLICY})


@router.get("/cases/{case_id}/scan.ply", response_class=StreamingResponse, responses=problems("file-not-ready"))
def read_surface(case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep) -> StreamingResponse:
    """The cleaned surface as PLY, in the file's own coordinates and unit."""
    store.note_reading(actor, case_id, "surface.read")
    name = {"Content-Disposition": 'attachment; filename="scan.ply"'}
    return StreamingResponse(files.stream(case_id, "scan.ply"), media_type="application/octet-stream", headers=name)
