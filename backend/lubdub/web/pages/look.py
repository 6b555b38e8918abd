"""Templates, words and the small facts every page needs. Strings go through gettext; English is the source."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from babel.core import Locale
from babel.lists import format_list
from fastapi import Request
from fastapi.responses import HTMLResponse
from jinja2 import Environment, FileSystemLoader, select_autoescape
from markupsafe import Markup

from lubdub.report.stationery import FontMissing, letters_for
from lubdub.views.scene import Sides
from lubdub.views.stickers import AREA_STYLES, Colour
from lubdub.web.framing import told_to_portal
from lubdub.web.guard import CSRF_FIELD, HasToken, csrf_token
from lubdub.web.languages import language_of, languages, words_of
from lubdub.web.nhsuk import FRONTEND
from lubdub.web.pages.emergency import emergency_numbers
from lubdub.web.pages.static import with_versions

STEPS = 7
DRAWING = FRONTEND / "parts" / "drawings" / "body.json"
"""The line drawing's lines and places, made from a reference body by `references.make.drawing`."""


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
        language=language,
        direction=Locale.parse(language).text_direction,
        steps=STEPS,
        places=place_looks(),
        body=json.loads(DRAWING.read_text()),
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


def person_words(request: Request) -> dict[str, str]:
    """How the page speaks of the person: as the case or the answers so far say."""
    _ = gettext_of(request)
    who = person_of(request)
    if who == "self":
        return {"person": _("the person who helps you"), "persons": _("your")}
    if who in ("sample", "other"):
        return {"person": _("the person"), "persons": _("the person's")}
    return {"person": _("your child"), "persons": _("your child's")}


def person_of(request: Request) -> str:
    """`child`, `self` or `sample`: of the case this page is about (`deps.own_case`) or of the answers so far."""
    return str(getattr(request.state, "person", "child"))


def sides_of(request: Request) -> Sides:
    """The words on the plates of a 3D view, in the page's language."""
    _ = gettext_of(request)
    right, left = _("patient's right"), _("patient's left")
    try:
        return Sides(_in_two(right), _in_two(left), letters_for(right + left))
    except FontMissing:
        return Sides()  # English plates are better than none


def _in_two(words: str) -> str:
    return "\n".join(words.rsplit(" ", 1))


def render(
    request: Request, template: str, session: HasToken | None = None, status_code: int = 200, **facts: Any
) -> HTMLResponse:
    """A page. session: whose form token goes into its forms."""
    numbers = emergency_numbers(request)
    facts = {
        "errors": {},
        "words": person_words(request),
        "is_sample": person_of(request) == "sample",
        "numbers": numbers,
        "number_words": format_list(numbers, "or", locale=language_of(request)),
        "languages": languages(),
        "here": request.url.path,
        "embedded": told_to_portal(request),
        **facts,
    }
    if session is not None:
        token = csrf_token(session)
        field = Markup('<input type="hidden" name="{}" value="{}">').format(CSRF_FIELD, token)
        facts |= {"csrf": lambda: field, "token": token}
    page = _environment(language_of(request)).get_template(template).render(**facts)
    headers = {"Content-Language": language_of(request), "Vary": "Accept-Language, Cookie"}
    return HTMLResponse(with_versions(page), status_code, headers)


def render_part(request: Request, template: str, session: HasToken, **facts: Any) -> str:
    """A piece of a page, to be swapped in by its script."""
    page: bytes | memoryview = render(request, template, session, **facts).body
    return bytes(page).decode()
