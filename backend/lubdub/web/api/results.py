"""REST: what a case ends with."""

from __future__ import annotations

import json
import threading
from typing import Any

from fastapi import APIRouter, Depends, Request
from fastapi.responses import HTMLResponse, Response, StreamingResponse

from lubdub.cases.errors import FileNotFound, StateConflict
from lubdub.cases.files import Artefact, FileVault
from lubdub.cases.review import Reviews
from lubdub.cases.reviewing import Review
from lubdub.cases.states import HAS_RESULT, TURNED_DOWN
from lubdub.cases.values import Actor, Case
from lubdub.report.archive import outcome_from_bytes
from lubdub.report.listening_words import listening_words
from lubdub.report.stationery import Paper
from lubdub.results import Outcome
from lubdub.views.export import STATIC_POLICY, result_html
from lubdub.web.api.cases import USUAL, CaseId
from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import BEARER, FilesDep, ReaderDep, ReviewsDep, StoreDep
from lubdub.web.languages import language_of
from lubdub.web.pages.look import gettext_of, sides_of
from lubdub.web.pages.result_words import ResultWords
from lubdub.web.pages.saved import saved_page
from lubdub.web.reviewed import review_json, shown_outcome, with_corrections
from lubdub.web.schemas import problems
from lubdub.web.schemas_result import ResultOut

VIEW_POLICY = f"sandbox allow-scripts; {STATIC_POLICY}; frame-ancestors 'self'"
"""The 3D page carries its scripts inside; it runs without an origin of its own and can reach no server."""

router = APIRouter(tags=["results"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)

BINARY = {"schema": {"type": "string", "format": "binary"}}

_drawing = threading.Lock()
VIEWS: dict[str, Artefact] = {"en": "view.html", "es": "view.es.html", "ja": "view.ja.html"}
REVIEWED_VIEWS: dict[str, Artefact] = {"en": "reviewed.html", "es": "reviewed.es.html", "ja": "reviewed.ja.html"}
"""Only the two plates on the body differ."""


def result_of(case: Case, actor: Actor, files: FileVault, reviews: Reviews) -> dict[str, Any]:
    """The result document, also for a case that was refused before any run. Raises StateConflict before the end."""
    if case.status not in (*HAS_RESULT, *TURNED_DOWN):
        raise StateConflict(f"There is no result while the case is {case.status.replace('_', ' ')}.")
    refusal = {"verdict": "refuse", "reasons": [] if case.reason is None else [dict(case.reason)]}
    if case.status in ("returned", "unusable"):
        return refusal | {"review": review_json(None, reviews.read(actor, case.id))}
    try:
        document: dict[str, Any] = json.loads(files.read(case.id, "result.json"))
    except FileNotFound:
        return refusal
    if case.status == "reviewed":
        outcome = outcome_from_bytes(files.read(case.id, "outcome.npz"))
        document["review"] = review_json(outcome, reviews.read(actor, case.id))
    return document


def picture_of(request: Request, case: Case, actor: Actor, files: FileVault, reviews: Reviews) -> str:
    """The 3D page of the result, drawn once for a language and then kept. Raises FileNotFound when there is none.

    One that a clinician signed is another page: corrections count from then on.
    """
    if case.status not in HAS_RESULT:
        raise FileNotFound("there are no places to draw")
    is_signed = case.status == "reviewed"
    kept = REVIEWED_VIEWS if is_signed else VIEWS
    name = kept.get(language_of(request), kept["en"])
    review = reviews.read(actor, case.id) if is_signed else Review()

    def draw(outcome: bytes) -> bytes:
        shown = with_corrections(outcome_from_bytes(outcome), review)
        return result_html(shown, case.age_years, sides_of(request)).encode()

    with _drawing:
        try:
            return files.read(case.id, name).decode()
        except FileNotFound:
            return files.derive(case.id, name, "outcome.npz", draw).decode()


RESULT: dict[int | str, dict[str, Any]] = {200: {"model": ResultOut, "description": "The result."}}


@router.get("/cases/{case_id}/result", responses=problems("state-conflict") | RESULT | UNCHANGED)
def read_result(
    case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep, reviews: ReviewsDep
) -> dict[str, Any]:
    """The four areas, or the reason why none are shown; positions in the file's own coordinates and unit."""
    return result_of(store.note_reading(actor, case_id, "result.read"), actor, files, reviews)


@router.get("/cases/{case_id}/view.html", response_class=HTMLResponse, responses=problems("file-not-ready"))
def read_view(
    request: Request, case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep, reviews: ReviewsDep
) -> HTMLResponse:
    """The result as one page that needs no connection: the body in 3D, the four places in words. Sandbox it."""
    case = store.note_reading(actor, case_id, "view.read")
    page = saved_result(request, case, actor, files, reviews)
    return HTMLResponse(page, headers={"Content-Security-Policy": VIEW_POLICY})


def saved_result(request: Request, case: Case, actor: Actor, files: FileVault, reviews: Reviews) -> str:
    """The result as one page. Raises FileNotFound when no places may be shown."""
    request.state.person = _spoken_of(actor, case)
    outcome, review = _shown(case, actor, files, reviews)
    return saved_page(request, case, outcome, review, picture_of(request, case, actor, files, reviews))


@router.get(
    "/cases/{case_id}/sheet.pdf",
    response_class=Response,
    responses=problems("file-not-ready") | {200: {"content": {"application/pdf": BINARY}, "description": "One page."}},
)
def read_sheet(
    request: Request,
    case_id: CaseId,
    actor: ReaderDep,
    store: StoreDep,
    files: FilesDep,
    reviews: ReviewsDep,
    paper: Paper = "a4",
) -> Response:
    """The sheet to print: the chest to scale with the four places, and how to find them. It says no name."""
    from lubdub.report.listening_sheet import listening_sheet  # the PDF library takes long to load

    case = store.note_reading(actor, case_id, "sheet.read")
    request.state.person = _spoken_of(actor, case)
    outcome, review = _shown(case, actor, files, reviews)
    words = listening_words(gettext_of(request))
    facts = ResultWords(request, case, outcome, review).sheet()
    sheet = listening_sheet(outcome, facts, words, paper, language_of(request))
    name = {"Content-Disposition": 'inline; filename="lubdub-places.pdf"'}
    return Response(sheet, media_type="application/pdf", headers=name)


def _shown(case: Case, actor: Actor, files: FileVault, reviews: Reviews) -> tuple[Outcome, Review]:
    """What is printed or saved. Raises FileNotFound when no places may be shown."""
    if case.status not in HAS_RESULT:
        raise FileNotFound("there are no places to show")
    outcome, review = shown_outcome(case, actor, files, reviews)
    if not outcome.areas:
        raise FileNotFound("there are no places to show")
    return outcome, review


def _spoken_of(actor: Actor, case: Case) -> str:
    """A family reads of "your child"; a portal of the patient; everybody is told of a sample."""
    return case.person if actor.kind == "family" or case.person == "sample" else "other"


@router.get(
    "/cases/{case_id}/scan.ply",
    response_class=StreamingResponse,
    responses=problems("file-not-ready")
    | {200: {"content": {"application/octet-stream": BINARY}, "description": "The PLY."}},
)
def read_surface(case_id: CaseId, actor: ReaderDep, store: StoreDep, files: FilesDep) -> StreamingResponse:
    """The cleaned surface as PLY, in the file's own coordinates and unit."""
    store.note_reading(actor, case_id, "surface.read")
    name = {"Content-Disposition": 'attachment; filename="scan.ply"'}
    return StreamingResponse(files.stream(case_id, "scan.ply"), media_type="application/octet-stream", headers=name)
