"""Styles, scripts and drawings: packed once, and kept by browsers for good, because their address changes with them."""

from __future__ import annotations

import gzip
import hashlib
import re
import time
from functools import lru_cache

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.web import nhsuk
from lubdub.web.nhsuk import FRONTEND, OURS
from lubdub.web.problems import Problem

TUS = FRONTEND / "node_modules" / "tus-js-client" / "dist" / "tus.min.js"
TYPES = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
FOR_GOOD = "public, max-age=31536000, immutable"
STATIC = re.compile(r'(?<=["\'])(/static/[\w./-]+\.(?:css|js|svg))(?=["\'])')

router = APIRouter(include_in_schema=False)


@router.get("/static/nhsuk.css")
def nhsuk_style(request: Request) -> Response:
    """What our pages use of the design system's style."""
    return _answer(request, nhsuk.style(), "text/css")


@router.get("/static/nhsuk.js")
def nhsuk_script(request: Request) -> Response:
    """The design system's behaviours."""
    return _answer(request, nhsuk.script(), "text/javascript")


@router.get("/static/tus.js")
def tus_script(request: Request) -> Response:
    """The client that sends a scan piece by piece."""
    if not TUS.is_file():
        raise Problem("not-ready", "The pages' scripts are not installed. Run ./lubdub once to fetch them.")
    return _answer(request, TUS.read_bytes().split(b"//# sourceMappingURL")[0], "text/javascript")


@router.get("/static/{path:path}")
def own_file(path: str, request: Request) -> Response:
    """A style, script or drawing from `frontend/`; nothing else of that folder."""
    place = (FRONTEND / path).resolve()
    media_type = TYPES.get(place.suffix)
    is_ours = any(place.is_relative_to(FRONTEND / folder) for folder in OURS)
    if media_type is None or not is_ours or not place.is_file():
        raise Problem("page-not-found", "There is no such file.")
    body = place.read_bytes()
    if place.suffix == ".js":
        body = with_versions(body.decode()).encode()
    return _answer(request, body, media_type)


@router.get("/favicon.ico")
def favicon(request: Request) -> Response:
    """The mark, for browsers that ask by habit."""
    return own_file("parts/mark/favicon.svg", request)


def with_versions(text: str) -> str:
    """A page or script whose addresses of our files carry the version, so that they may be kept for good."""
    version = files_version()
    return STATIC.sub(rf"\1?v={version}", text)


def files_version() -> str:
    """Changes when any of the files does, a second later at most."""
    return _version_in(int(time.monotonic()))


@lru_cache(maxsize=1)
def _version_in(second: int) -> str:
    files = (file for folder in OURS for file in sorted((FRONTEND / folder).rglob("*.*")) if file.suffix in TYPES)
    stamps = ((str(file), (stat := file.stat()).st_mtime_ns, stat.st_size) for file in files)
    return hashlib.sha256(repr([*stamps, nhsuk.NHSUK.stat().st_mtime_ns]).encode()).hexdigest()[:10]


def _answer(request: Request, body: bytes, media_type: str) -> Response:
    etag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    is_versioned = request.query_params.get("v") == files_version()
    headers = {"ETag": etag, "Cache-Control": FOR_GOOD if is_versioned else "no-cache", "Vary": "Accept-Encoding"}
    if request.headers.get("if-none-match") == etag:
        return Response(status_code=304, headers=headers)
    if "gzip" in request.headers.get("accept-encoding", ""):
        body, headers["Content-Encoding"] = _packed(body), "gzip"
    return Response(body, media_type=f"{media_type}; charset=utf-8", headers=headers)


@lru_cache(maxsize=256)
def _packed(body: bytes) -> bytes:
    return gzip.compress(body, 9, mtime=0)
