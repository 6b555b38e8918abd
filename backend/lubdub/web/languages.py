"""In which language a page speaks: as chosen in its header, else as the browser asks, else English."""

from __future__ import annotations

import io
from functools import lru_cache
from pathlib import Path

from babel.core import negotiate_locale
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po
from babel.support import NullTranslations, Translations
from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse

from lubdub.web.deps import SettingsDep
from lubdub.web.guard import own_path
from lubdub.web.nhsuk import FRONTEND

WORDS = FRONTEND / "words"
COOKIE = "lubdub_language"
KEPT_S = 365 * 24 * 3600
ENGLISH = "en"
NAMES = {"en": "English", "es": "Español", "ja": "日本語"}
"""Each language by the name its speakers give it. One without a catalogue is not offered."""

router = APIRouter(include_in_schema=False)


@lru_cache(maxsize=1)
def languages() -> dict[str, str]:
    """Code -> name of every language that the pages speak."""
    return {code: name for code, name in NAMES.items() if code == ENGLISH or _catalogue(code).exists()}


@lru_cache(maxsize=8)
def words_of(language: str) -> NullTranslations:
    """A language's sentences, read from its catalogue; English needs none, and what is missing stays English."""
    place = _catalogue(language)
    if not place.exists():
        return NullTranslations()
    compiled = io.BytesIO()
    with place.open("rb") as file:
        write_mo(compiled, read_po(file, locale=language))
    compiled.seek(0)
    return Translations(compiled)


def language_of(request: Request) -> str:
    """The language of this request's page. request.state.language: said by a portal for this page alone."""
    chosen = getattr(request.state, "language", None) or request.cookies.get(COOKIE)
    if chosen in languages():
        return str(chosen)
    asked = [word.split(";")[0].strip() for word in request.headers.get("accept-language", "").split(",")]
    return negotiate_locale([word for word in asked if word], list(languages()), sep="-") or ENGLISH


@router.get("/language")
def choose(to: str, settings: SettingsDep, back: str = "/") -> RedirectResponse:
    """Speak this language from now on, and show the page again. back: a path of our own; others lead to the start."""
    answer = RedirectResponse(own_path(back, "/"), 303)
    if to in languages():
        answer.set_cookie(COOKIE, to, max_age=KEPT_S, httponly=True, samesite="lax", secure=settings.is_https)
    return answer


def _catalogue(language: str) -> Path:
    return WORDS / language / "LC_MESSAGES" / "messages.po"
