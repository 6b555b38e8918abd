"""REST: cases inside a portal's own pages."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Depends

from lubdub.settings import is_loopback
from lubdub.web.api.cases import USUAL, CaseId
from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import BEARER, EmbeddingDep, KeyManagerDep, PortalWriterDep, SettingsDep
from lubdub.web.framing import is_origin
from lubdub.web.problems import Problem
from lubdub.web.schemas import problems
from lubdub.web.schemas_embed import EmbedIn, EmbedOut, OriginsIn, OriginsOut, message_schema

router = APIRouter(tags=["embedding"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)
public = APIRouter(include_in_schema=False)


@router.get("/embedding", responses=UNCHANGED)
def read_embedding(actor: KeyManagerDep, embedding: EmbeddingDep) -> OriginsOut:
    """Which origins' pages may frame your cases."""
    return OriginsOut(origins=list(embedding.origins(actor)))


@router.put("/embedding", responses=problems("too-large"))
def change_embedding(
    said: OriginsIn, actor: KeyManagerDep, embedding: EmbeddingDep, settings: SettingsDep
) -> OriginsOut:
    """Say which origins' pages may frame your cases, instead of those said before."""
    for origin in said.origins:
        if not is_origin(origin, allow_http=is_loopback(settings.host)):
            raise Problem("invalid-input", "origins: each must be like https://portal.example, without a path.")
    return OriginsOut(origins=list(embedding.set_origins(actor, said.origins)))


@router.post("/cases/{case_id}/embed", status_code=201, responses=problems("state-conflict", "too-large"))
def create_embed_link(
    case_id: CaseId, asked: EmbedIn, actor: PortalWriterDep, embedding: EmbeddingDep, settings: SettingsDep
) -> EmbedOut:
    """A link for an iframe in your page: it works once, within five minutes, and only in a frame on your origins.

    With `journey` the person in front of the frame has the case, until the next such link of this case is opened."""
    link = embedding.offer(actor, case_id, asked.shows)
    language = "" if asked.language is None else f"?language={asked.language}"
    return EmbedOut(url=f"{settings.address}/embed/{link.token}{language}", expires_at=link.expires_at)


@public.get("/api/embed-messages.schema.json")
def read_message_schema() -> dict[str, Any]:
    """What framed pages send by `postMessage`; for everybody."""
    return message_schema()
