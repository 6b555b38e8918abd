"""Styles, scripts and drawings of our own, and nhsuk-frontend without the fonts it would fetch from elsewhere."""

from __future__ import annotations

import hashlib
import re
from functools import lru_cache
from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.web.pages_look import FRONTEND
from lubdub.web.problems import Problem

TYPES = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
OURS = ("style", "parts", "family", "clinician", "lib")
NHSUK = FRONTEND / "node_modules" / "nhsuk-frontend" / "dist" / "nhsuk"

router = APIRouter(include_in_schema=False)


@router.get("/static/nhsuk.css")
def nhsuk_style(request: Request) -> Response:
    """The design system's style, with its remote fonts, unneeded pictures and foreign font name taken out."""
    return _answer(request, _nhsuk_css(), "text/css")


@router.get("/static/nhsuk.js")
def nhsuk_script(request: Request) -> Response:
    """The design system's behaviours."""
    return _answer(request, _nhsuk_js(), "text/javascript")


@router.get("/static/{path:path}")
def own_file(path: str, request: Request) -> Response:
    """A style, script or drawing from `frontend/`; nothing else of that folder."""
    place = (FRONTEND / path).resolve()
    media_type = TYPES.get(place.suffix)
    is_ours = any(place.is_relative_to(FRONTEND / folder) for folder in OURS)
    if media_type is None or not is_ours or not place.is_file():
        raise Problem("page-not-found", "There is no such file.")
    return _answer(request, place.read_bytes(), media_type)


@router.get("/favicon.ico")
def favicon(request: Request) -> Response:
    """The mark, for browsers that ask by habit."""
    return own_file("parts/mark/favicon.svg", request)


def _answer(request: Request, body: bytes, media_type: str) -> Response:
    etag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if request.headers.get("if-none-match") == etag:
        return Response(status_code=304, headers=headers)
    return Response(body, media_type=f"{media_type}; charset=utf-8", headers=headers)


@lru_cache(maxsize=1)
def _nhsuk_css() -> bytes:
    css = _installed("nhsuk-frontend.min.css").read_text(encoding="utf-8")
    return without_foreign(css).encode()


def without_foreign(css: str) -> str:
    """A style without anything fetched: no @font-face, no url(...) but data, no name of a font we may not use."""
    css = re.sub(r"@font-face\{[^}]*\}", "", css)
    css = re.sub(r"url\((?!['\"]?data:)[^)]*\)", "none", css)
    css = css.replace("Frutiger W01,arial", "system-ui,arial")
    return re.sub(r"/\*# sourceMappingURL=.*?\*/", "", css)


@lru_cache(maxsize=1)
def _nhsuk_js() -> bytes:
    script = _installed("nhsuk-frontend.min.js").read_text(encoding="utf-8")
    return re.sub(r"//# sourceMappingURL=\S+", "", script).encode()


def _installed(name: str) -> Path:
    place = NHSUK / name
    if not place.is_file():
        raise Problem("not-ready", "The pages' style is not installed. Run ./lubdub once to fetch it.")
    return place
