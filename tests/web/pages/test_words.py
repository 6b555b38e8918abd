"""Every sentence of the pages is in the catalogue, in every language, and plain enough."""

from __future__ import annotations

import ast
import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
import textstat
from babel.messages.catalog import Catalog, Message
from babel.messages.pofile import read_po
from babel.support import NullTranslations

from lubdub.web import languages
from lubdub.web.languages import words_of
from lubdub.web.nhsuk import FRONTEND
from tests.web.service import ROOT

WORDS = FRONTEND / "words"
TRANSLATED = ["es", "ja"]
SIDES = {"es": ("izquierd", "derech"), "ja": ("左", "右")}
HOLE = re.compile(r"%\(\w+\)s|\{\w*\}|</?\w+>")


def collector() -> ModuleType:
    spec = importlib.util.spec_from_file_location("collect", WORDS / "collect.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def read(place: Path) -> Catalog:
    with place.open("rb") as file:
        return read_po(file)


def catalogue(language: str) -> Catalog:
    return read(WORDS / language / "LC_MESSAGES" / "messages.po")


def forms(message: Message) -> Iterator[tuple[str, str]]:
    """Each English form with its translation. A language with one form for all numbers translates the plural."""
    if isinstance(message.id, str):
        yield message.id, str(message.string)
        return
    said = [message.string] if isinstance(message.string, str) else list(message.string)
    yield from zip(message.id[-len(said) :], said, strict=True)


def test_the_catalogue_holds_every_sentence_and_no_other() -> None:
    listed = {message.id for message in read(WORDS / "messages.pot") if message.id}
    assert {message.id for message in collector().collected() if message.id} == listed


def test_no_sentence_is_handed_to_a_translator_that_the_collector_does_not_see() -> None:
    """`gettext_of(request)("…")` has no name to collect by."""
    nameless = [
        f"{path.name}:{call.lineno}"
        for path in sorted((ROOT / "backend" / "lubdub" / "web").glob("*.py"))
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Call) and "gettext" in ast.unparse(call.func)
    ]
    assert nameless == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_sentence_is_translated_and_nothing_else(language: str) -> None:
    ours = {message.id for message in collector().collected() if message.id}
    theirs = catalogue(language)
    assert {message.id for message in theirs if message.id} == ours
    assert not theirs.obsolete
    empty = [message.id for message in theirs if message.id and not all(said for _, said in forms(message))]
    assert empty == []
    assert [message.id for message in theirs if message.id and message.fuzzy] == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_translation_keeps_what_is_filled_in(language: str) -> None:
    broken = [
        (english, said)
        for message in catalogue(language)
        if message.id
        for english, said in forms(message)
        if sorted(HOLE.findall(english)) != sorted(HOLE.findall(said))
    ]
    assert broken == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_left_stays_left_and_right_stays_right(language: str) -> None:
    """Where English says a side alone, the translation says this side and not the other."""
    left, right = SIDES[language]
    swapped = []
    checked = 0
    for message in catalogue(language):
        for english, said in forms(message) if message.id else ():
            is_left, is_right = (f"{side} " in re.sub(r"\W", " ", english.lower()) + " " for side in ("left", "right"))
            if is_left == is_right or not (left in said.lower() or right in said.lower()):
                continue
            checked += 1
            own, other = (left, right) if is_left else (right, left)
            if own not in said.lower() or other in said.lower():
                swapped.append((english, said))
    assert swapped == []
    assert checked > 15


def plain(sentence: str) -> str:
    """As it is read: what is filled in is a short word, and it ends."""
    filled = HOLE.sub("ten", sentence).strip()
    return filled if filled[-1:] in ".!?:" else filled + "."


def english() -> list[str]:
    """Every English form."""
    found = (message.id for message in read(WORDS / "messages.pot") if message.id)
    return [plain(one) for ids in found for one in ([ids] if isinstance(ids, str) else ids)]


def test_a_child_of_nine_to_eleven_can_read_it() -> None:
    """US school grades as Flesch and Kincaid count them: grade 5 is read with ten or eleven."""
    assert textstat.flesch_kincaid_grade(" ".join(english())) <= 4
    long = [one for one in english() if len(one.split()) > 7]
    hard = {one: grade for one in long if (grade := textstat.flesch_kincaid_grade(one)) > 8.5}
    assert hard == {}


def test_a_hard_sentence_would_be_noticed() -> None:
    bureaucratic = (
        "Insufficient anatomical correspondence necessitates repeating the acquisition procedure immediately."
    )
    assert textstat.flesch_kincaid_grade(bureaucratic) > 15


def test_a_translation_reaches_the_page_and_what_is_missing_stays_english(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "de" / "LC_MESSAGES" / "messages.po"
    place.parent.mkdir(parents=True)
    place.write_text('msgid ""\nmsgstr "Content-Type: text/plain; charset=UTF-8\\n"\n\nmsgid "Back"\nmsgstr "Zurück"\n')
    monkeypatch.setattr(languages, "WORDS", tmp_path)
    words_of.cache_clear()
    try:
        assert words_of("de").gettext("Back") == "Zurück"
        assert words_of("de").gettext("Continue") == "Continue"
        assert isinstance(words_of("fr"), NullTranslations)
    finally:
        words_of.cache_clear()
