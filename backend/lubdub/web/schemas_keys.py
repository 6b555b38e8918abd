"""The shapes of keys and tokens in REST."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal, get_args

from pydantic import BaseModel, Field

from lubdub.cases.people import SCOPES
from lubdub.cases.values import PortalKey
from lubdub.web.schemas import Strict

Scope = Literal["cases:read", "cases:write", "keys:manage", "webhooks:manage"]
if get_args(Scope) != SCOPES:
    raise TypeError("the documented scopes are not those that exist")


class KeyIn(Strict):
    """A new key."""

    name: str = Field(min_length=1, max_length=200, description="What you call it, such as `night import`.")
    scopes: Annotated[list[Scope], Field(min_length=1, max_length=len(SCOPES))]


class RotationIn(Strict):
    """How the old key goes."""

    overlap_hours: float = Field(24, ge=0, le=168, description="Hours for which the old key works on.")


class KeyOut(BaseModel):
    """A key, without its token."""

    id: str = Field(description="Also the `client_id` of OAuth 2.0; the token is the `client_secret`.")
    name: str
    prefix: str = Field(description="How its token begins, to recognise it by.")
    scopes: list[Scope]
    sandbox: bool = Field(description="Whether it opens made-up cases alone.")
    created_at: datetime
    last_used_at: datetime | None = Field(description="To the minute.")
    expires_at: datetime | None = Field(description="When it ends because it was rotated.")
    revoked_at: datetime | None

    @classmethod
    def of(cls, key: PortalKey) -> KeyOut:
        """From the store's value."""
        return cls.model_validate(_told(key))


class NewKeyOut(KeyOut):
    """A new key, with its token."""

    token: str = Field(description="Shown this once; only its hash is kept.")

    @classmethod
    def with_token(cls, key: PortalKey, token: str) -> NewKeyOut:
        """From the store's value and the token."""
        return cls.model_validate(_told(key) | {"token": token})


class KeysOut(BaseModel):
    """All keys of a portal."""

    items: list[KeyOut]


class TokenOut(BaseModel):
    """An access token (RFC 6749 section 5.1)."""

    access_token: str
    token_type: Literal["Bearer"] = "Bearer"  # nosec B105 (the word of the standard)
    expires_in: int = Field(description="Seconds.")
    scope: str = Field(description="What it may do, separated by spaces.")


class TokenProblemOut(BaseModel):
    """Why there is no token (RFC 6749 section 5.2)."""

    error: Literal["invalid_request", "invalid_client", "unsupported_grant_type", "invalid_scope"]
    error_description: str


def _told(key: PortalKey) -> dict[str, object]:
    return {
        "id": key.id,
        "name": key.name,
        "prefix": key.prefix,
        "scopes": key.scopes,
        "sandbox": key.is_sandbox,
        "created_at": key.created_at,
        "last_used_at": key.last_used_at,
        "expires_at": key.expires_at,
        "revoked_at": key.revoked_at,
    }
