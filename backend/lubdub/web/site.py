"""The pages of family and desk: one router over all, and the page shown when something is not as it should be."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import JSONResponse, Response

from lubdub.web import languages, view
from lubdub.web.desk import (
    account,
    audit,
    body_view,
    families,
    holds,
    join,
    oidc,
    passkeys,
    people,
    references,
    review,
    sign_in,
    worklist,
)
from lubdub.web.desk import view as desk_view
from lubdub.web.desk.common import is_desk, to_sign_in, to_sign_in_again
from lubdub.web.pages import (
    ask,
    consent,
    embed,
    feel,
    guide,
    handoff,
    invited,
    points,
    result,
    scan,
    start,
    static,
    stickers,
    waiting,
)
from lubdub.web.pages.common import wants_json
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.problems import Problem, problem_response

router = APIRouter()
PARTS = (
    static,
    languages,
    stickers,
    embed,
    start,
    ask,
    consent,
    guide,
    scan,
    handoff,
    invited,
    waiting,
    feel,
    points,
    result,
    join,
    sign_in,
    oidc,
    account,
    passkeys,
    people,
    families,
    audit,
    holds,
    worklist,
    review,
    references,
)
for part in PARTS:
    router.include_router(part.router)


def install(app: FastAPI) -> None:
    """Put the pages, the live views and the error page into the application."""
    app.include_router(router)
    app.include_router(view.router)
    app.include_router(desk_view.router)
    app.include_router(body_view.router)
    app.state.error_page = error_page


def install_views(app: FastAPI) -> None:
    """Put in the live views alone, with the pages that stand around them and must be served by the same process."""
    for part in (points, review, references, view, desk_view, body_view):
        app.include_router(part.router)
    app.state.error_page = error_page


def error_page(request: Request, problem: Problem) -> Response:
    """A problem in plain words, with a way on."""
    if wants_json(request) or request.url.path.startswith("/static/"):
        return _as_json(request, problem)
    if problem.kind == "not-signed-in" and is_desk(request):
        return to_sign_in(request)
    if problem.kind == "sign-in-again":
        return to_sign_in_again(request, (account.ACCOUNT, people.PEOPLE))
    _ = gettext_of(request)
    heading, message = _words(problem, _)
    case_id = request.path_params.get("case_id")
    is_known = case_id is not None and problem.status_code != 404
    if is_desk(request):
        return render(
            request,
            "clinician/lost/lost.html",
            status_code=problem.status_code,
            heading=heading,
            message=message,
        )
    return render(
        request,
        "family/lost/lost.html",
        status_code=problem.status_code,
        heading=heading,
        message=message,
        retry=f"/cases/{case_id}" if is_known else "/",
        retry_words=_("Go on where I was") if is_known else _("To the start page"),
    )


def _words(problem: Problem, _: Callable[[str], str]) -> tuple[str, str]:
    """Heading and sentence of the page that tells of a problem."""
    by_status = {
        404: (
            _("There is nothing here"),
            _("The page was deleted, has moved, or belongs to somebody else. Nothing of yours is lost."),
        ),
        403: (
            _("This page is too old"),
            _("It was open for a long time. Load it again and repeat the last thing you did."),
        ),
        409: (
            _("That does not fit right now"),
            _("Something has changed, perhaps in another window. Nothing is lost: go on where you were."),
        ),
        405: (_("There is nothing here"), _("Pages are opened by their buttons and links. Go back and use those.")),
        422: (
            _("Something is missing"),
            _("What was sent is not what this page asks for. Load it again and answer once more."),
        ),
        413: (
            _("The file is too large"),
            _("Export the scan with less detail, or cut it down to the chest, and send it again."),
        ),
        429: (_("Please wait a moment"), _("There were very many calls in a short time. Try again in a minute.")),
        503: (_("Please wait a moment"), _("The service is not ready right now. Try again in a few minutes.")),
    }
    ours = _("Something went wrong on our side"), _("It is not your fault, and nothing of yours is lost. Try again.")
    by_kind = {
        "point-not-placed": (_("That does not fit right now"), problem.detail),
        "role-missing": (_("Your role does not allow this"), _("Ask an administrator of your organisation.")),
        "consent-missing": (
            _("First a few questions"),
            _("Nobody has agreed to the scan yet. Go to the start page and answer its questions."),
        ),
    }
    return by_kind.get(problem.kind) or by_status.get(problem.status_code, ours)


def _as_json(request: Request, problem: Problem) -> JSONResponse:
    return problem_response(problem, getattr(request.state, "request_id", None))
