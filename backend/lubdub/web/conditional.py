"""Answers that are only sent when they changed: `ETag` on what portals poll, 304 for who has it already."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request
from fastapi.routing import APIRoute
from starlette.responses import Response

UNCHANGED: dict[int | str, dict[str, Any]] = {
    304: {"description": "Nothing changed since the answer whose `ETag` came back in `If-None-Match`."}
}


class ConditionalRoute(APIRoute):
    """A route whose JSON answers to GET carry an ETag. A weak one: packed or not, the answer is the same."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The usual handler, and after it the comparison."""
        answer = super().get_route_handler()

        async def compared(request: Request) -> Response:
            response = await answer(request)
            if request.method != "GET" or response.status_code != 200 or not _is_json(response):
                return response
            tag = f'W/"{hashlib.sha256(bytes(response.body)).hexdigest()[:32]}"'
            if tag in _known(request):
                return Response(status_code=304, headers={"ETag": tag})
            response.headers["ETag"] = tag
            return response

        return compared


def _is_json(response: Response) -> bool:
    return response.headers.get("content-type", "").startswith(("application/json", "application/fhir+json"))


def _known(request: Request) -> set[str]:
    said = request.headers.get("if-none-match", "")
    tags = (tag.strip() for tag in said.split(","))
    return {tag if tag.startswith("W/") else f"W/{tag}" for tag in tags}
