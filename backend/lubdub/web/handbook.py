"""Pages for security officers and operations teams: what is protected, what is measured, and which test shows it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from datetime import timedelta
from importlib import resources
from typing import Any

import jinja2
from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from lubdub.jobs.logs import ALLOWED
from lubdub.jobs.metrics import described
from lubdub.jobs.tracing import ALLOWED as TRACED
from lubdub.jobs.tracing import INSTALL
from lubdub.settings import Settings
from lubdub.web.deps_desk import FRESH
from lubdub.web.guard import SAFE_METHODS

router = APIRouter(include_in_schema=False)

_templates = jinja2.Environment(loader=jinja2.PackageLoader("lubdub.web", "documents"), autoescape=True)


def asvs() -> dict[str, Any]:
    """The table of items: shown (item -> words and tests), open and absent (item -> why)."""
    return tomllib.loads(resources.files("lubdub.web").joinpath("documents/asvs.toml").read_text())


@router.get("/api/docs/security", response_class=HTMLResponse)
def security(request: Request) -> HTMLResponse:
    """What is protected, against whom, and what is not; and the ASVS items."""
    settings: Settings = request.app.state.settings
    page = _templates.get_template("security.html").render(
        table=asvs(),
        settings=settings,
        fresh_minutes=FRESH // timedelta(minutes=1),
        writes=list(_writes(request.app.openapi())),
    )
    return HTMLResponse(page)


def _writes(document: dict[str, Any]) -> Iterator[tuple[str, str, list[str]]]:
    """Each call of the interface that changes something, the scope it needs, and the fields it takes."""
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            if method.upper() in SAFE_METHODS:
                continue
            scopes = [scope for way in operation.get("security", []) for scope in way.get("OAuth2", [])]
            bodies = operation.get("requestBody", {}).get("content", {}).values()
            fields = [field for body in bodies for field in _fields(body["schema"], document)]
            yield f"{method.upper()} {path}", ", ".join(scopes) or "the secret of a key", fields


def _fields(schema: dict[str, Any], document: dict[str, Any]) -> Iterator[str]:
    """The names of what a body may say; those of a part inside it behind a dot."""
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    if schema.get("format") == "binary":
        yield "the bytes of a scan"
    for part in schema.get("anyOf", []):
        yield from _fields(part, document)
    for name, part in schema.get("properties", {}).items():
        inner = list(_fields(part, document))
        yield from (f"{name}.{one}" for one in inner) if inner else [name]


@router.get("/api/docs/operation", response_class=HTMLResponse)
def operation(request: Request) -> HTMLResponse:
    """Logs, numbers, health, stopping and upgrading."""
    settings: Settings = request.app.state.settings
    page = _templates.get_template("operation.html")
    lists = {"numbers": described(), "fields": sorted(ALLOWED), "traced": sorted(TRACED)}
    return HTMLResponse(page.render(lists, install=INSTALL, settings=settings))
