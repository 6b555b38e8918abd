"""The family's pages: one router over all steps, and the page shown when something is not as it should be."""

from __future__ import annotations

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import JSONResponse, Response

from lubdub.web import pages_points, pages_result, pages_scan, pages_start, pages_static, pages_stickers, view
from lubdub.web.pages_common import wants_json
from lubdub.web.pages_look import gettext_of, render
from lubdub.web.problems import Problem, problem_response

router = APIRouter()
for part in (pages_static, pages_stickers, pages_start, pages_scan, pages_points, pages_result):
    router.include_router(part.router)


def install(app: FastAPI) -> None:
    """Put the pages, the live views and the error page into the application."""
    app.include_router(router)
    app.include_router(view.router)
    app.state.error_page = error_page


def error_page(request: Request, problem: Problem) -> Response:
    """A problem in plain words, with a way on."""
    if wants_json(request) or request.url.path.startswith("/static/"):
        return _as_json(request, problem)
    _ = gettext_of(request)
    headings = {
        404: _("There is nothing here"),
        403: _("This page is too old"),
        409: _("That does not fit right now"),
        413: _("The file is too large"),
        429: _("Please wait a moment"),
    }
    messages = {
        404: _("The page was deleted, has moved, or belongs to somebody else. Nothing of yours is lost."),
        403: _("It was open for a long time. Load it again and repeat the last thing you did."),
    }
    case_id = request.path_params.get("case_id")
    is_known = case_id is not None and problem.status_code != 404
    return render(
        request,
        "family/lost/lost.html",
        status_code=problem.status_code,
        heading=headings.get(problem.status_code, _("Something went wrong on our side")),
        message=messages.get(problem.status_code, problem.detail),
        retry=f"/cases/{case_id}" if is_known else "/",
        retry_words=_("Go on where I was") if is_known else _("To the start page"),
    )


def _as_json(request: Request, problem: Problem) -> JSONResponse:
    return problem_response(problem, getattr(request.state, "request_id", None))
