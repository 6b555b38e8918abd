"""The shapes of embedding: in REST, and in the messages that framed pages send to the page around them."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, TypeAdapter

from lubdub.cases.states import Status
from lubdub.web.schemas import Strict

Origin = Annotated[str, Field(max_length=200, examples=["https://portal.example"])]


class OriginsIn(Strict):
    """The origins whose pages may frame your cases."""

    origins: Annotated[list[Origin], Field(max_length=10, description="https, without a path; none to allow nobody.")]


class OriginsOut(BaseModel):
    """The origins whose pages may frame your cases."""

    origins: list[str]


class EmbedIn(Strict):
    """What the frame shows."""

    shows: Literal["result", "journey"] = Field(description="The finished result alone, or every page of the case.")
    language: Literal["en", "es", "ja"] | None = Field(None, description="Of the pages; as the browser asks when null.")


class EmbedOut(BaseModel):
    """A link for the `src` of an iframe."""

    url: str = Field(description="Works once, in a frame.")
    expires_at: datetime


class StateMessage(Strict):
    """Sent when a framed page shows: where the case stands."""

    source: Literal["lubdub"]
    version: Literal[1]
    type: Literal["state"]
    case: str
    status: Status


class SizeMessage(Strict):
    """Sent when a framed page becomes higher or lower, so that the frame can follow."""

    source: Literal["lubdub"]
    version: Literal[1]
    type: Literal["size"]
    case: str
    height: int = Field(ge=0, description="CSS pixels.")


MESSAGE: TypeAdapter[StateMessage | SizeMessage] = TypeAdapter(
    Annotated[StateMessage | SizeMessage, Field(discriminator="type")]
)


def message_schema() -> dict[str, Any]:
    """Every message as a JSON Schema (2020-12). Members may be added; a change of these is a new `version`."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **MESSAGE.json_schema()}
