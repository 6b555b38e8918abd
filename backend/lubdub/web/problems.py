"""Problems as RFC 9457 says them: one table of kinds, each with a stable `type`, a status and a title."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.responses import Response

from lubdub.cases import errors
from lubdub.cases.away import is_away
from lubdub.jobs.metrics import TOLD

MEDIA_TYPE = "application/problem+json"

AWAY = "We cannot reach our own records and files at the moment. Nothing is lost: please come back later."
AWAY_S = 60
"""When to come back."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ProblemKind:
    """status: HTTP; title: the same for every problem of the kind."""

    status: int
    title: str


PROBLEMS: dict[str, ProblemKind] = {
    "case-not-found": ProblemKind(404, "There is no such case"),
    "file-not-ready": ProblemKind(404, "The case has no such file yet"),
    "upload-not-found": ProblemKind(404, "There is no such upload"),
    "key-not-found": ProblemKind(404, "There is no such key"),
    "webhook-not-found": ProblemKind(404, "There is no such webhook"),
    "delivery-not-found": ProblemKind(404, "The webhook has no such message"),
    "sample-not-found": ProblemKind(404, "There is no such sample body"),
    "body-not-found": ProblemKind(404, "There is no such reference body"),
    "page-not-found": ProblemKind(404, "There is nothing at this address"),
    "method-not-allowed": ProblemKind(405, "This address does not take that method"),
    "not-signed-in": ProblemKind(401, "A key or a session is needed"),
    "sign-in-again": ProblemKind(403, "Signing in was too long ago for this"),
    "scope-missing": ProblemKind(403, "The key does not allow this"),
    "sandbox-takes-samples": ProblemKind(403, "A sandbox takes sample bodies alone"),
    "role-missing": ProblemKind(403, "The role does not allow this"),
    "consent-missing": ProblemKind(403, "Nobody has agreed to this yet"),
    "cross-site": ProblemKind(403, "The call did not come from a page of this service"),
    "state-conflict": ProblemKind(409, "The case's state does not allow this now"),
    "point-not-placed": ProblemKind(409, "The point cannot be placed like this"),
    "wrong-offset": ProblemKind(409, "The piece does not begin where the upload ends"),
    "tus-version": ProblemKind(412, "This version of the tus protocol is not spoken here"),
    "wrong-media-type": ProblemKind(415, "The body is not of the media type this call takes"),
    "too-large": ProblemKind(413, "The body is larger than allowed"),
    "empty-body": ProblemKind(422, "The body is empty"),
    "invalid-input": ProblemKind(422, "What was sent does not fit"),
    "webhook-address": ProblemKind(422, "This address is not called"),
    "idempotency-mismatch": ProblemKind(422, "The idempotency key was used with another call"),
    "bad-request": ProblemKind(400, "The request cannot be understood"),
    "too-many-requests": ProblemKind(429, "Too many calls in a short time"),
    "upload-quota": ProblemKind(429, "No more scans are taken from here today"),
    "unknown-host": ProblemKind(421, "This service does not go by that name"),
    "not-ready": ProblemKind(503, "The service is not ready"),
    "internal": ProblemKind(500, "Something went wrong inside"),
}


class Problem(HTTPException):
    """A problem to be told to the caller. extra: further members of the problem document."""

    def __init__(self, kind: str, detail: str, headers: Mapping[str, str] | None = None, **extra: Any) -> None:
        """kind: a key of PROBLEMS; detail: one sentence about this very problem."""
        super().__init__(PROBLEMS[kind].status, detail, None if headers is None else dict(headers))
        self.kind = kind
        self.extra = extra

    def document(self, request_id: str | None = None) -> dict[str, Any]:
        """The problem as JSON."""
        known = PROBLEMS[self.kind]
        document = {
            "type": f"/problems/{self.kind}",
            "title": known.title,
            "status": known.status,
            "detail": self.detail,
            **self.extra,
        }
        return document if request_id is None else document | {"instance": f"urn:request:{request_id}"}


def from_error(error: Exception) -> Problem:
    """The problem an exception amounts to; an unknown one is ours and says nothing about itself."""
    if isinstance(error, Problem):
        return error
    if isinstance(error, errors.CaseNotFound):
        return Problem("case-not-found", "There is no case with this id, or it is not yours, or it was deleted.")
    if isinstance(error, errors.FileNotFound):
        return Problem("file-not-ready", "The case does not have this file, or does not have it yet.")
    if isinstance(error, errors.UploadNotFound):
        return Problem("upload-not-found", "There is no upload with this id, or it ended, or it waited too long.")
    if isinstance(error, errors.KeyNotFound):
        return Problem("key-not-found", "There is no key with this id, or it is not yours.")
    if isinstance(error, errors.WebhookNotFound):
        return Problem("webhook-not-found", "There is no webhook with this id, or it is not yours.")
    if isinstance(error, errors.DeliveryNotFound):
        return Problem("delivery-not-found", "There is no message with this id, or its log was dropped.")
    if isinstance(error, errors.BodyNotFound):
        return Problem("body-not-found", "There is no reference body of this name, or it is not yours to see.")
    if isinstance(error, errors.BadCursor):
        return Problem("bad-request", "The cursor was not made here. Begin with the first page again.")
    if isinstance(error, errors.WrongOffset):
        return Problem("wrong-offset", "Another piece came first. Ask where the upload stands, and go on from there.")
    if isinstance(error, errors.StateConflict):
        return Problem("state-conflict", str(error))
    if isinstance(error, errors.IdempotencyMismatch):
        return Problem("idempotency-mismatch", "This Idempotency-Key came before with another call. Use a new key.")
    if isinstance(error, errors.SignInRefused):
        return Problem("not-signed-in", "This did not fit. Try again.")
    if isinstance(error, errors.NotAllowed):
        return Problem("state-conflict", str(error))
    if isinstance(error, errors.TooManyTries):
        return Problem("too-many-requests", str(error), {"Retry-After": str(error.seconds)})
    if isinstance(error, RequestValidationError):
        return _from_validation(error)
    if isinstance(error, HTTPException):
        return _from_http(error)
    if is_away(error):
        return Problem("not-ready", AWAY, {"Retry-After": str(AWAY_S)})
    return Problem("internal", "This is our fault, not yours. Please try again; nothing was lost.")


def _from_validation(error: RequestValidationError) -> Problem:
    """Where and why, without repeating what was sent: it may be about a person."""
    faults = [{"where": list(map(str, one["loc"])), "why": str(one["msg"])} for one in error.errors()]
    first = faults[0]
    return Problem("invalid-input", f"{'.'.join(first['where'][1:]) or 'body'}: {first['why']}", errors=faults)


def _from_http(error: HTTPException) -> Problem:
    kinds = {404: "page-not-found", 405: "method-not-allowed", 413: "too-large"}
    kind = kinds.get(error.status_code, "bad-request" if error.status_code < 500 else "internal")
    return Problem(kind, str(error.detail), error.headers)


def note_problem(kind: str) -> None:
    """Count it, and log it beside the call's own line. Who called stands in neither."""
    TOLD.labels(kind).inc()
    log.info("refused", extra={"kind": kind})


async def answer_error(request: Request, error: Exception) -> Response:
    """The answer to any error: a problem document, or a page as `app.state.error_page` draws it.

    error_page: a function (request, problem) -> response, set by the pages; programs and sockets get JSON.
    """
    problem = from_error(error)
    note_problem(problem.kind)
    if problem.kind == "internal":
        log.error("a request failed", exc_info=error)
    elif problem.detail == AWAY:
        log.error("the database or the store is away: %s", type(error).__name__)
    draw = getattr(request.app.state, "error_page", None)
    is_page = request.scope["type"] == "http" and not request.url.path.startswith(("/api/", "/livez", "/readyz"))
    if draw is not None and is_page:
        page: Response = draw(request, problem)
        return page
    return problem_response(problem, getattr(request.state, "request_id", None))


def install_problems(app: FastAPI) -> None:
    """Answer every error that is somebody's mistake; `Envelope` answers those that are ours."""
    handled: tuple[type[Exception], ...] = (
        HTTPException,
        RequestValidationError,
        errors.CaseNotFound,
        errors.FileNotFound,
        errors.StateConflict,
        errors.UploadNotFound,
        errors.KeyNotFound,
        errors.WebhookNotFound,
        errors.DeliveryNotFound,
        errors.BadCursor,
        errors.BodyNotFound,
        errors.WrongOffset,
        errors.IdempotencyMismatch,
        errors.NotAllowed,
        errors.SignInRefused,
        errors.TooManyTries,
    )
    for kind in handled:
        app.add_exception_handler(kind, answer_error)


def problem_response(problem: Problem, request_id: str | None = None) -> JSONResponse:
    """The problem as a response."""
    return JSONResponse(problem.document(request_id), problem.status_code, problem.headers, MEDIA_TYPE)
