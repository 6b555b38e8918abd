"""Is the process alive, and can it do its work?"""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse

from lubdub.web.deps import ServicesDep

router = APIRouter(tags=["health"])


@router.get("/livez")
def alive() -> dict[str, str]:
    """The process answers."""
    return {"status": "alive"}


@router.get("/readyz", responses={503: {"description": "Something needed does not work; it says what."}})
def ready(request: Request, services: ServicesDep) -> JSONResponse:
    """Database and store (write, read, delete), key and a living worker; and which solver the worker has."""
    if request.app.state.is_stopping():
        return JSONResponse({"ready": False, "checks": {"stopping": False}, "solver": None}, 503)
    document = services.readiness.look()
    return JSONResponse(document, 200 if document["ready"] else 503)
