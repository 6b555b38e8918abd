"""REST: OAuth 2.0 client credentials (RFC 6749 section 4.4): a key is exchanged for a token that soon ends."""

from __future__ import annotations

import base64
import binascii
from typing import Annotated, Any
from urllib.parse import unquote_plus

from fastapi import APIRouter, Depends, Form, Request
from fastapi.responses import JSONResponse, Response
from fastapi.security import HTTPBasic

from lubdub.web.deps import KeysDep
from lubdub.web.schemas import problems
from lubdub.web.schemas_keys import TokenOut, TokenProblemOut

BASIC = HTTPBasic(auto_error=False, description="The key's id as the user, its token as the password.")
REFUSED: dict[int | str, dict[str, Any]] = {
    400: {"model": TokenProblemOut, "description": "The request is not one this service can answer."},
    401: {"model": TokenProblemOut, "description": "Id and token do not belong together, or the key has ended."},
}

router = APIRouter(tags=["keys"], dependencies=[Depends(BASIC)])

Field = Annotated[str, Form(max_length=1000)]


@router.post(
    "/oauth/token",
    response_model=TokenOut,
    responses=REFUSED | problems("too-large", "invalid-input", "too-many-requests"),
)
def issue_token(  # nosec B107 (what is missing is an empty word, and refused)
    request: Request,
    keys: KeysDep,
    grant_type: Field = "",
    client_id: Field = "",
    client_secret: Field = "",
    scope: Annotated[str, Form(max_length=1000, description="Less than the key has; all of it when empty.")] = "",
) -> Response:
    """A token for an hour, by `grant_type=client_credentials`. Who calls is said by Basic or in the form's fields."""
    if grant_type != "client_credentials":
        return _refused("unsupported_grant_type", "Only client_credentials is granted here.")
    said = _basic(request)
    if said is not None and client_secret:
        return _refused("invalid_request", "Say who you are once: by Basic or in the form.")
    who, secret = said or (client_id, client_secret)
    try:
        granted = keys.exchange(who, secret, scope.split())
    except ValueError as error:
        return _refused("invalid_scope", str(error))
    if granted is None:
        return _refused("invalid_client", "There is no living key with this id and token.", 401)
    told = TokenOut(access_token=granted.token, expires_in=granted.lasts_s, scope=" ".join(granted.scopes))
    return JSONResponse(told.model_dump(), headers={"Pragma": "no-cache"})


def _basic(request: Request) -> tuple[str, str] | None:
    """Id and token from the Authorization header; both are form-encoded there (RFC 6749 section 2.3.1)."""
    kind, _, said = request.headers.get("authorization", "").partition(" ")
    if kind.lower() != "basic":
        return None
    try:
        who, _, secret = base64.b64decode(said, validate=True).decode().partition(":")
    except (binascii.Error, UnicodeDecodeError):
        return "", ""
    return unquote_plus(who), unquote_plus(secret)


def _refused(error: str, why: str, status: int = 400) -> Response:
    headers = {"WWW-Authenticate": 'Basic realm="lubdub"'} if status == 401 else {}
    return JSONResponse({"error": error, "error_description": why}, status, headers)
