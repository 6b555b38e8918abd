"""Where a portal's link leads: into the frame, once."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from lubdub.cases.errors import FrameLinkSpent
from lubdub.cases.values import Case
from lubdub.web import guard
from lubdub.web.api.results import VIEW_POLICY, saved_result
from lubdub.web.deps import EmbeddingDep, FilesDep, ReviewsDep, SettingsDep, StoreDep
from lubdub.web.framing import STATE
from lubdub.web.languages import COOKIE as LANGUAGE
from lubdub.web.languages import languages
from lubdub.web.pages.look import render
from lubdub.web.problems import Problem

router = APIRouter(include_in_schema=False)


@router.get("/embed/{token}")
def entered(
    request: Request,
    token: str,
    embedding: EmbeddingDep,
    store: StoreDep,
    files: FilesDep,
    reviews: ReviewsDep,
    settings: SettingsDep,
    language: str = "",
) -> Response:
    """Shows the result, or goes on to the case's page in a session of its own. Outside a frame nothing happens."""
    if request.headers.get("sec-fetch-dest") not in ("iframe", "frame"):
        raise Problem("page-not-found", "This address works inside the page of a portal alone.")
    try:
        opened = embedding.take(token)
    except FrameLinkSpent as spent:
        if spent.origins:
            setattr(request.state, STATE, spent.origins)
        request.state.language = language
        return render(request, "family/lost/spent_frame.html", status_code=404)
    setattr(request.state, STATE, opened.origins)
    request.state.case = opened.case
    if opened.session is not None:
        return _on(opened.case, guard.session_cookie(settings, opened.session), language)
    request.state.language = language
    case = store.note_reading(opened.actor, opened.case.id, "view.read")
    page = saved_result(request, case, opened.actor, files, reviews)
    return HTMLResponse(page, headers={"Content-Security-Policy": VIEW_POLICY})


def _on(case: Case, cookie: str, language: str) -> Response:
    answer = RedirectResponse(f"/cases/{case.id}", 303, {"Set-Cookie": cookie})
    if language in languages():
        kept = f"{LANGUAGE}={language}; Path=/; HttpOnly; SameSite=None; Secure; Partitioned"
        answer.headers.append("Set-Cookie", kept)
    return answer
