"""What our pages and scripts may do in a browser, read from their sources."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.rules.source import ROOT, modules, tracked_files

FRONTEND = ROOT / "frontend"
SCRIPTS = [path for path in tracked_files() if path.is_relative_to(FRONTEND) and path.suffix == ".js"]
PAGES = [
    path
    for path in tracked_files()
    if path.suffix == ".html" and (path.is_relative_to(FRONTEND) or path.parent.name == "documents")
]

OUR_OWN_MARKUP = {
    "clinician/review/review.js": "panel.innerHTML = now.panel;",
    "clinician/worklist/worklist.js": 'list.innerHTML = page.getElementById("worklist").innerHTML;',
    "family/points/points.js": "for (const [name, piece] of pieces) piece.innerHTML = now[name];",
}
"""Pieces of pages, drawn and escaped by the server's templates, are swapped in; nothing else is read as markup."""
MARKUP = re.compile(r"(?:inner|outer)HTML|insertAdjacentHTML|document\.write|createContextualFragment|setHTML|srcdoc")
EVALUATED = re.compile(r"\beval\(|\bFunction\(|set(?:Timeout|Interval)\(\s*[\"'`]|javascript:|import\(")
KEPT = re.compile(r"localStorage|sessionStorage|indexedDB|document\.cookie|caches\.")
POLLUTING = re.compile(
    r"__proto__|\.prototype[.\[]|\.constructor\b|Object\.assign|\w\[[A-Za-z_][\w.]*\]\s*=[^=]|\bfor \(\w+ \w+ in "
)


def named(path: Path) -> str:
    return str(path.relative_to(FRONTEND if path.is_relative_to(FRONTEND) else ROOT))


every_script = pytest.mark.parametrize("script", SCRIPTS, ids=named)
every_page = pytest.mark.parametrize("page", PAGES, ids=named)


def lines_with(path: Path, pattern: re.Pattern[str]) -> list[str]:
    return [line.strip() for line in path.read_text().splitlines() if pattern.search(line.partition(" // ")[0])]


def test_there_are_scripts_and_pages_to_read() -> None:
    assert len(SCRIPTS) >= 10
    assert len(PAGES) >= 40


@every_script
def test_a_script_writes_text_as_text(script: Path) -> None:
    known = OUR_OWN_MARKUP.get(named(script))
    assert lines_with(script, MARKUP) == ([] if known is None else [known])


@every_script
def test_a_script_evaluates_nothing(script: Path) -> None:
    assert lines_with(script, EVALUATED) == []


@every_script
def test_a_script_keeps_nothing_in_the_browser_but_where_an_upload_stands(script: Path) -> None:
    kept = lines_with(script, KEPT)
    if named(script) == "family/scan/scan.js":
        assert all("localStorage.removeItem(mark)" in line or "Object.keys(localStorage)" in line for line in kept)
    else:
        assert kept == []


@every_script
def test_a_script_writes_to_no_key_that_came_from_elsewhere(script: Path) -> None:
    assert lines_with(script, POLLUTING) == []


@every_script
def test_a_script_does_not_hinder_pasting(script: Path) -> None:
    assert lines_with(script, re.compile(r"[\"'](?:paste|beforeinput)[\"']")) == []


WHOLE_IN_ITSELF = "family/saved/saved.html"
"""A file to keep, opened without us: its style and script, files of ours, stand inside it."""


@every_page
def test_a_page_is_plain_html_whose_scripts_are_modules_of_ours(page: Path) -> None:
    text = page.read_text()
    scripts = re.findall(r"<script\b[^>]*>", text)
    data = '<script type="application/json" id="steps-words">'
    ours = re.compile(
        r'<script (?:type="module"|defer)(?: async)?(?: fetchpriority="low")? src="/static/[\w/.-]+\.js">'
    )
    assert [tag for tag in scripts if not ours.fullmatch(tag) and tag != data] == (
        ['<script type="module">'] if named(page) == WHOLE_IN_ITSELF else []
    )
    assert re.findall(r"(?i)<(?:applet|embed|object|frameset|base)\b", text) == []
    assert re.findall(r"(?i)\s(on[a-z]+)=[\"']", text) == []
    assert "javascript:" not in text


@every_page
def test_a_page_escapes_what_it_is_given(page: Path) -> None:
    unescaped = re.findall(r"\{\{ (\w+) \|\s*safe \}\}", page.read_text())
    assert len(unescaped) == len(re.findall(r"\|\s*safe\b|autoescape", page.read_text()))
    assert unescaped == (["style", "script"] if named(page) == WHOLE_IN_ITSELF else [])


def test_what_is_downloaded_has_a_name_of_ours() -> None:
    said = [
        line.strip()
        for module in modules()
        for line in module.path.read_text().splitlines()
        if "content-disposition" in line.lower()
    ]
    assert len(said) >= 4
    ours = re.compile(
        r"\{?.*\"Content-Disposition\": f?'(?:inline|attachment); filename=\"[a-z{}-]+(?:\.[a-z]+)?\"'[,}]?"
    )
    assert [line for line in said if not ours.search(line)] == []
