"""Our pages inside a portal's: who may frame them, said on every answer of a session that lives there."""

from __future__ import annotations

import re
from typing import Any
from urllib.parse import urlsplit

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection

from lubdub.cases.values import Case, FamilySession

STATE = "framed_by"
"""Where the connection's state holds the origins, for the envelope and the pages."""
FRAMED_PAGES = ("/cases/", "/view/")
"""What a session in a frame may see: its case and nothing else."""
ANCESTORS = re.compile(r"frame-ancestors 'self'")


def note_framing(connection: HTTPConnection, session: FamilySession | None) -> None:
    """Let this answer be framed by the session's portal, if it lives in one."""
    if session is not None and session.is_embedded:
        setattr(connection.state, STATE, session.origins)


def allow_framing(headers: MutableHeaders, origins: tuple[str, ...]) -> None:
    """Name the portal's origins beside our own. X-Frame-Options knows no list, so it goes."""
    del headers["X-Frame-Options"]
    policy = headers["Content-Security-Policy"]
    headers["Content-Security-Policy"] = ANCESTORS.sub(" ".join(("frame-ancestors 'self'", *origins)), policy)


def told_to_portal(connection: HTTPConnection) -> dict[str, Any] | None:
    """What a framed page's script tells the page around it, and whom; None for a page that is not framed."""
    origins = getattr(connection.state, STATE, None)
    case: Case | None = getattr(connection.state, "case", None)
    if origins is None or case is None:
        return None
    return {"origins": origins, "case": case.id, "status": case.status}


def is_origin(text: str, allow_http: bool) -> bool:
    """Whether the text is a plain origin, such as https://portal.example or, where allowed, http://localhost:5000."""
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError:
        return False
    if parts.scheme not in (("https", "http") if allow_http else ("https",)) or not parts.hostname:
        return False
    if re.fullmatch(r"[a-z0-9]([a-z0-9.-]*[a-z0-9])?", parts.hostname) is None:
        return False
    return text == f"{parts.scheme}://{parts.hostname}" + (f":{port}" if port else "")
