"""What the OpenAPI document needs beside what FastAPI finds by itself."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI

from lubdub.web.schemas import ProblemOut


def document_problems(app: FastAPI) -> None:
    """Put the shape of problems, at which every call's errors point, among the document's shapes."""
    found = app.openapi

    def whole() -> dict[str, Any]:
        document = found()
        document["components"]["schemas"].setdefault("ProblemOut", ProblemOut.model_json_schema())
        return document

    app.openapi = whole  # type: ignore[method-assign]
