"""The application: layers, REST, health, documentation and site."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Literal

from fastapi import FastAPI
from fastapi.telemetry import TelemetryConfig
from starlette.middleware.gzip import GZipMiddleware

from lubdub import __version__
from lubdub.jobs.metrics import serve_metrics, watch_database
from lubdub.jobs.tracing import start_tracing
from lubdub.settings import Settings
from lubdub.web import docs, handbook, health, site
from lubdub.web.api import cases, embed, events, fhir, keys, oauth, results, samples, sharing, uploads, webhooks
from lubdub.web.documented import document_problems
from lubdub.web.envelope import Envelope
from lubdub.web.hosts import KnownHosts
from lubdub.web.limits import BodyLimit, RateLimit
from lubdub.web.problems import install_problems
from lubdub.web.services import open_services

REST = (
    cases,
    events,
    uploads,
    results,
    fhir,
    sharing,
    samples,
    webhooks,
    embed,
    keys,
    oauth,
)
DESCRIPTION = (
    "Shows a lay person where on the chest in the uploaded scan the four usual heart-listening areas are estimated "
    "to be, so that sounds can be recorded for a clinician. It does not listen, does not diagnose, is not for "
    "emergencies, and a clinician must confirm the positions."
)


NO_TELEMETRY: TelemetryConfig = {"tracing": False, "metrics": False, "logs": False, "auto_configure": False}
"""The framework's own would tell whole paths and query strings, with the cases' ids; ours is `lubdub.jobs.tracing`."""

WebRole = Literal["web", "view"]
"""web: everything. view: what must stay with one process for each case, behind a proxy that sees to it."""


def create_app(settings: Settings, role: WebRole = "web") -> FastAPI:
    """The web application. Nothing is opened before it starts; it closes what it opened when it stops.

    `lubdub.web.site.install(app)` brings the pages: routers, static files and `app.state.error_page`.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        app.state.services = open_services(settings)
        watch_database(app.state.services.database)
        end_metrics = serve_metrics(settings, app.state.services.desk)
        end_tracing = start_tracing(settings, role)
        app.state.announce()
        yield
        end_tracing()
        end_metrics()
        app.state.services.close()

    app = FastAPI(
        title="Lubdub",
        telemetry=NO_TELEMETRY,
        version=__version__,
        description=DESCRIPTION,
        lifespan=lifespan,
        openapi_url="/api/v1/openapi.json" if role == "web" else None,
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.settings = settings
    # Replaced by the server that runs it: whom to tell that it is ready, and whether it is about to end.
    app.state.announce = lambda: None
    app.state.is_stopping = lambda: False
    app.include_router(health.router)
    install_problems(app)
    if role == "view":
        site.install_views(app)
    else:
        _install_all(app)
    app.add_middleware(GZipMiddleware, minimum_size=500, compresslevel=6)
    app.add_middleware(RateLimit, settings=settings, rates=lambda: app.state.services.rates)
    app.add_middleware(BodyLimit, settings=settings)
    app.add_middleware(KnownHosts, settings=settings)
    app.add_middleware(Envelope, is_https=settings.is_https)
    return app


def _install_all(app: FastAPI) -> None:
    for room in REST:
        app.include_router(room.router, prefix="/api/v1")
    for room in (fhir, embed):
        app.include_router(room.public)
    app.include_router(docs.router)
    app.include_router(handbook.router)
    document_problems(app)
    site.install(app)
