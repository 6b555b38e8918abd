"""Which language a page speaks: the chosen one, else the browser's, else English; and the way back stays ours."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from fastapi import Request

from lubdub.web import languages
from lubdub.web.languages import COOKIE, language_of, words_of
from tests.web.service import Service


@pytest.fixture
def three_languages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for code in ("es", "ja"):
        place = tmp_path / code / "LC_MESSAGES" / "messages.po"
        place.parent.mkdir(parents=True)
        place.write_text('msgid ""\nmsgstr "Content-Type: text/plain; charset=UTF-8\\n"\n')
    monkeypatch.setattr(languages, "WORDS", tmp_path)
    for remembered in (languages.languages, words_of):
        remembered.cache_clear()
    yield
    for remembered in (languages.languages, words_of):
        remembered.cache_clear()


def asking(**headers: str) -> Request:
    raw = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return Request({"type": "http", "headers": raw})


@pytest.mark.usefixtures("three_languages")
@pytest.mark.parametrize(
    ("asked", "spoken"),
    [
        ("ja", "ja"),
        ("ja-JP,ja;q=0.9,en;q=0.5", "ja"),
        ("es-MX", "es"),
        ("de-AT,es;q=0.8", "es"),
        ("de", "en"),
        ("", "en"),
        ("*, ;q=x", "en"),
    ],
)
def test_the_browsers_first_language_that_is_spoken_is_used(asked: str, spoken: str) -> None:
    assert language_of(asking(accept_language=asked)) == spoken


@pytest.mark.usefixtures("three_languages")
def test_a_chosen_language_counts_more_than_the_browsers() -> None:
    assert language_of(asking(accept_language="ja", cookie=f"{COOKIE}=es")) == "es"
    assert language_of(asking(accept_language="ja", cookie=f"{COOKIE}=xx")) == "ja"


@pytest.mark.parametrize("back", ["//elsewhere.example/x", "https://elsewhere.example", "/\\elsewhere", "/a\r\nX: y"])
def test_the_way_back_never_leads_elsewhere(service: Service, back: str) -> None:
    answer = httpx.get(f"{service.settings.address}/language", params={"to": "en", "back": back})
    assert answer.headers["location"] == "/"


def test_choosing_a_language_returns_to_the_page_and_is_remembered(service: Service) -> None:
    answer = httpx.get(f"{service.settings.address}/language", params={"to": "en", "back": "/ask/who"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/ask/who")
    assert f"{COOKIE}=en" in answer.headers["set-cookie"]
    unknown = httpx.get(f"{service.settings.address}/language", params={"to": "xx"})
    assert "set-cookie" not in unknown.headers


def test_a_page_says_its_language(service: Service) -> None:
    answer = httpx.get(service.settings.address)
    assert answer.headers["content-language"] == "en"
    assert "Accept-Language" in answer.headers["vary"]
    assert '<html lang="en" dir="ltr">' in answer.text
