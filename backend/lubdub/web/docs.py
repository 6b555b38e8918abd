"""The interface explained on one page, with nothing loaded from elsewhere; and what each kind of problem means."""

from __future__ import annotations

from typing import Any

import jinja2
from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, Response
from markupsafe import Markup, escape

from lubdub.settings import Settings
from lubdub.web.problems import PROBLEMS, Problem

router = APIRouter(include_in_schema=False)

SNIPPETS = ("journey.sh", "journey.py", "token.sh", "webhook.py", "embed.html")
"""Programs to copy from the page; the tests copy and run them."""

_plain = jinja2.Environment(loader=jinja2.PackageLoader("lubdub.web", "documents/snippets"))  # nosec B701 (no page)
_templates = jinja2.Environment(loader=jinja2.PackageLoader("lubdub.web", "documents"), autoescape=True)


def _code(text: str) -> Markup:
    """The text with what stands between backticks as code."""
    pieces = text.split("`")
    return Markup("").join(Markup("<code>{}</code>").format(p) if i % 2 else escape(p) for i, p in enumerate(pieces))


_templates.filters["code"] = _code


@router.get("/api/docs", response_class=HTMLResponse)
def documentation(request: Request) -> HTMLResponse:
    """From key to result, and every call of the OpenAPI document with its parameters and answers."""
    document = request.app.openapi()
    settings: Settings = request.app.state.settings
    page = _templates.get_template("docs.html").render(
        document=document,
        operations=_operations(document),
        problems=PROBLEMS,
        snippets={name: _plain.get_template(f"{name}.j2").render(address=settings.address) for name in SNIPPETS},
        per_minute=settings.requests_per_minute,
        max_mb=settings.max_upload_mb,
        snomed=settings.snomed,
    )
    return HTMLResponse(page)


@router.get("/api/docs/scaling", response_class=HTMLResponse)
def scaling() -> HTMLResponse:
    """On many machines: what is stateless, what is sticky, what to scale by; and a million cases a day."""
    return HTMLResponse(_templates.get_template("scaling.html").render())


@router.get("/api/docs.css")
def style() -> Response:
    """How that page looks."""
    return Response(_templates.get_template("docs.css").render(), media_type="text/css")


@router.get("/problems/{kind}")
def problem_kind(kind: str) -> dict[str, Any]:
    """What a problem's `type` leads to."""
    if kind not in PROBLEMS:
        raise Problem("page-not-found", "There is no such kind of problem.")
    return {"type": f"/problems/{kind}", "title": PROBLEMS[kind].title, "status": PROBLEMS[kind].status}


def _operations(document: dict[str, Any]) -> list[dict[str, Any]]:
    """One entry per path and method, in the order they are defined."""
    return [
        {"path": path, "method": method.upper(), **operation}
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]
