"""REST: a portal's own keys."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Depends, Path, Response

from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import BEARER, KeyManagerDep, KeysDep, ManagerScopesDep
from lubdub.web.problems import Problem
from lubdub.web.schemas import problems
from lubdub.web.schemas_keys import KeyIn, KeyOut, KeysOut, NewKeyOut, RotationIn

USUAL = problems("bad-request", "not-signed-in", "scope-missing", "key-not-found", "invalid-input", "too-many-requests")

router = APIRouter(tags=["keys"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)

KeyId = Annotated[str, Path(max_length=64, description="The key's id, which is no secret.")]


@router.get("/keys", responses=UNCHANGED)
def list_keys(actor: KeyManagerDep, keys: KeysDep) -> KeysOut:
    """Your keys, oldest first: what each may do, and when it was used last, to the minute."""
    return KeysOut(items=[KeyOut.of(key) for key in keys.all_of(actor)])


@router.post("/keys", status_code=201, responses=problems("state-conflict", "too-large"))
def create_key(new: KeyIn, actor: KeyManagerDep, own: ManagerScopesDep, keys: KeysDep) -> NewKeyOut:
    """One more key. Its token is in the answer, this once. No key gives more than it has itself."""
    beyond = sorted(set(new.scopes) - set(own))
    if beyond:
        raise Problem("scope-missing", f"Your own key does not have the scope {beyond[0]}.")
    return NewKeyOut.with_token(*keys.create(actor, new.name, new.scopes))


@router.post("/keys/{key_id}/rotate", status_code=201, responses=problems("state-conflict", "too-large"))
def rotate_key(
    key_id: KeyId, asked: RotationIn, actor: KeyManagerDep, own: ManagerScopesDep, keys: KeysDep
) -> NewKeyOut:
    """A new key in the place of this one, which works on for `overlap_hours` and then ends."""
    old = next((key for key in keys.all_of(actor) if key.id == key_id), None)
    beyond = [] if old is None else sorted(set(old.scopes) - set(own))
    if beyond:
        raise Problem("scope-missing", f"Your own key does not have the scope {beyond[0]}.")
    return NewKeyOut.with_token(*keys.rotate(actor, key_id, timedelta(hours=asked.overlap_hours)))


@router.delete("/keys/{key_id}", status_code=204)
def revoke_key(key_id: KeyId, actor: KeyManagerDep, keys: KeysDep) -> Response:
    """End a key at once, and every token it was exchanged for."""
    keys.revoke(actor, key_id)
    return Response(status_code=204)
