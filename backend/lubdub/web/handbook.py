"""Pages for security officers and operations teams: what is protected, what is measured, and which test shows it."""

from __future__ import annotations

import tomllib
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

router = APIRouter(include_in_schema=False)

_templates = jinja2.Environment(loader=jinja2.PackageLoader("lubdub.web", "documents"), autoescape=True)


def asvs() -> dict[str, Any]:
    """The table of items: shown (item -> words and tests), open and absent (item -> why)."""
    return tomllib.loads(resources.files("lubdub.web").joinpath("documents/asvs.toml").read_text())


@router.get("/api/docs/security", response_class=HTMLResponse)
def security(request: Request) -> HTMLResponse:
    """What is protected, against whom, and what is not; and the ASVS items."""
    settings: Settings = request.app.state.settings
    page = _templates.get_template("security.html")
    return HTMLResponse(page.render(table=asvs(), settings=settings, fresh_minutes=FRESH // timedelta(minutes=1)))


@router.get("/api/docs/operation", response_class=HTMLResponse)
def operation(request: Request) -> HTMLResponse:
    """Logs, numbers, health, stopping and upgrading."""
    settings: Settings = request.app.state.settings
    page = _templates.get_template("operation.html")
    lists = {"numbers": described(), "fields": sorted(ALLOWED), "traced": sorted(TRACED)}
    return HTMLResponse(page.render(lists, install=INSTALL, settings=settings))
