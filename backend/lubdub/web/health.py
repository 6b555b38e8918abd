"""Is the process alive, and can it do its work?"""

from __future__ import annotations

import logging
from collections.abc import Callable
from datetime import timedelta

from fastapi import APIRouter
from fastapi.responses import JSONResponse

from lubdub.cases.clock import now
from lubdub.web.deps import ServicesDep
from lubdub.web.services import Services

WORKER_SEEN = timedelta(seconds=30)
"""A worker tells that it lives every 5 s."""

router = APIRouter(tags=["health"])
log = logging.getLogger(__name__)


@router.get("/livez")
def alive() -> dict[str, str]:
    """The process answers."""
    return {"status": "alive"}


@router.get("/readyz", responses={503: {"description": "Something needed does not work; it says what."}})
def ready(services: ServicesDep) -> JSONResponse:
    """Database, store (write, read, delete), key and a living worker; and which solver the worker has."""
    checks = {
        "database": _works(services.database.ask),
        "store": _works(services.files.probe),
        "key": _works(services.files.check_key),
        "worker": _works(lambda: _worker_lives(services)),
    }
    seen = services.desk.last_seen() if checks["database"] else None
    document = {
        "ready": all(checks.values()),
        "checks": checks,
        "solver": None if seen is None else seen.solver,
    }
    return JSONResponse(document, 200 if document["ready"] else 503)


def _works(check: Callable[[], object]) -> bool:
    try:
        check()
    except Exception as error:  # whatever is broken, the answer is the same: not ready
        log.warning("not ready: %s", type(error).__name__)
        return False
    return True


def _worker_lives(services: Services) -> None:
    seen = services.desk.last_seen()
    if seen is None or now() - seen.at > WORKER_SEEN:
        raise TimeoutError("no worker was seen lately")
