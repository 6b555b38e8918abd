"""Templates, words and the small facts every page needs. Strings go through gettext; English is the source."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from babel.messages.pofile import read_po
from babel.support import NullTranslations
from fastapi import Request
from fastapi.responses import HTMLResponse, Response
from jinja2 import Environment, FileSystemLoader, select_autoescape
from markupsafe import Markup

from lubdub.cases.values import FamilySession
from lubdub.settings import PROJECT_FOLDER, Settings
from lubdub.views.stickers import AREA_STYLES, Colour
from lubdub.web.guard import CSRF_FIELD, csrf_token

FRONTEND = PROJECT_FOLDER / "frontend"
WHO_COOKIE = "lubdub_who"
STEPS = 5
DRAWING = FRONTEND / "parts" / "drawings" / "body.json"
"""The line drawing's lines and places, made from a reference body by `references.make.drawing`."""


class Words(NullTranslations):
    """One language's sentences, read from its catalogue; a sentence without translation stays English."""

    def __init__(self, catalogue: Path | None) -> None:
        """Over a `.po` file, or none for English."""
        super().__init__()
        self._said: dict[str, str] = {}
        if catalogue is not None:
            with catalogue.open("rb") as file:
                self._said = {
                    str(message.id): str(message.string) for message in read_po(file) if message.id and message.string
                }

    def gettext(self, message: str) -> str:
        """The sentence in this language."""
        return self._said.get(message, message)


@lru_cache(maxsize=8)
def words_of(language: str) -> Words:
    """The catalogue of a language; English needs none."""
    catalogue = FRONTEND / "words" / language / "LC_MESSAGES" / "messages.po"
    return Words(catalogue if catalogue.exists() else None)


@lru_cache(maxsize=8)
def _environment(language: str) -> Environment:
    environment = Environment(
        loader=FileSystemLoader(FRONTEND),
        autoescape=select_autoescape(("html", "svg")),
        extensions=["jinja2.ext.i18n"],
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.install_gettext_translations(words_of(language), newstyle=True)  # type: ignore[attr-defined]
    environment.globals.update(
        language=language, steps=STEPS, places=place_looks(), body=json.loads(DRAWING.read_text())
    )
    return environment


def place_looks() -> list[dict[str, Any]]:
    """The four areas as drawn everywhere: number, letter, shape, colours."""
    return [
        {
            "key": name,
            "number": style.number,
            "letter": style.letter,
            "shape": style.shape,
            "colour": _hex(style.colour),
            "ink": _hex(style.ink),
        }
        for name, style in AREA_STYLES.items()
    ]


def _hex(colour: Colour) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


def gettext_of(request: Request) -> Callable[[str], str]:
    """`_` for words that are put together in Python."""
    return words_of(language_of(request)).gettext


def language_of(request: Request) -> str:
    """English until there is a second catalogue."""
    return "en"


def person_words(request: Request) -> dict[str, str]:
    """How the page speaks of the person: as chosen on the second page."""
    _ = gettext_of(request)
    who = request.cookies.get(WHO_COOKIE)
    if who == "self":
        return {"person": _("the person who helps you"), "persons": _("your")}
    if who == "sample":
        return {"person": _("the person"), "persons": _("the person's")}
    return {"person": _("your child"), "persons": _("your child's")}


def remember_who(response: Response, who: str, settings: Settings) -> Response:
    """Keep how to speak of the person: `child`, `self` or `sample`."""
    response.set_cookie(WHO_COOKIE, who, httponly=True, samesite="lax", secure=settings.is_https)
    return response


def render(
    request: Request, template: str, session: FamilySession | None = None, status_code: int = 200, **facts: Any
) -> HTMLResponse:
    """A page. session: whose form token goes into its forms."""
    facts = {"errors": {}, "words": person_words(request), **facts}
    if session is not None:
        token = csrf_token(session)
        field = Markup('<input type="hidden" name="{}" value="{}">').format(CSRF_FIELD, token)
        facts |= {"csrf": lambda: field, "token": token}
    page = _environment(language_of(request)).get_template(template).render(**facts)
    return HTMLResponse(page, status_code)


def render_part(request: Request, template: str, session: FamilySession, **facts: Any) -> str:
    """A piece of a page, to be swapped in by its script."""
    page: bytes | memoryview = render(request, template, session, **facts).body
    return bytes(page).decode()
