"""The result as one file to keep: everything the page needs stands inside it."""

from __future__ import annotations

from fastapi import Request

from lubdub.cases.reviewing import Review
from lubdub.cases.values import Case
from lubdub.results import Outcome
from lubdub.views.export import STATIC_POLICY
from lubdub.web.framing import told_to_portal
from lubdub.web.nhsuk import FRONTEND
from lubdub.web.pages.look import render
from lubdub.web.pages.result_words import ResultWords

STYLES = ("parts/steps/steps.css", "family/saved/saved.css")
SCRIPT = "parts/steps/steps.js"
EMBEDDED = "lib/embedded.js"


def saved_page(request: Request, case: Case, outcome: Outcome, review: Review, picture: str) -> str:
    """The file's HTML. picture: the bare 3D page, which goes into a frame of its own inside it."""
    words = ResultWords(request, case, outcome, review)
    scripts = (SCRIPT,) if told_to_portal(request) is None else (SCRIPT, EMBEDDED)
    page = render(
        request,
        "family/saved/saved.html",
        policy=STATIC_POLICY,
        style="\n".join((FRONTEND / name).read_text(encoding="utf-8") for name in STYLES),
        script="\n".join((FRONTEND / name).read_text(encoding="utf-8") for name in scripts),
        picture=picture,
        heading=words.heading(),
        lead=words.lead(),
        whose=words.whose(),
        checked=words.checked(),
        reasons=words.reasons(),
        found=words.places(),
        how=words.how(),
        not_words=words.not_diagnosis(),
        ring_words=words.ring(),
    ).body
    return bytes(page).decode()
