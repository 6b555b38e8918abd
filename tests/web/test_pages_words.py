"""Every sentence of the pages is in the catalogue, and a translation reaches the page."""

from __future__ import annotations

from pathlib import Path

from babel.messages.extract import extract_from_dir
from babel.messages.frontend import parse_mapping_cfg
from babel.messages.pofile import read_po

from lubdub.web.pages_look import FRONTEND, Words
from tests.rules.source import ROOT


def sentences() -> set[str]:
    with (FRONTEND / "words" / "babel.cfg").open(encoding="utf-8") as file:
        methods, _options = parse_mapping_cfg(file)
    folders = (
        ("backend/lubdub/web", "backend/lubdub/web/"),
        ("frontend/family", "frontend/family/"),
        ("frontend/parts", "frontend/parts/"),
    )
    found: set[str] = set()
    for folder, prefix in folders:
        within = [(pattern.removeprefix(prefix), method) for pattern, method in methods if pattern.startswith(prefix)]
        for _file, _line, message, _comments, _context in extract_from_dir(
            ROOT / folder, within, {}, keywords={"_": None, "gettext": None, "ngettext": (1, 2)}
        ):
            found.add(message if isinstance(message, str) else message[0])
    return found


def test_the_catalogue_holds_every_sentence_and_no_other() -> None:
    with (FRONTEND / "words" / "messages.pot").open("rb") as file:
        listed = {str(message.id) for message in read_po(file) if message.id}
    assert sentences() == listed


def test_a_translation_reaches_the_page_and_what_is_missing_stays_english(tmp_path: Path) -> None:
    catalogue = tmp_path / "messages.po"
    catalogue.write_text(
        'msgid ""\nmsgstr "Content-Type: text/plain; charset=UTF-8\\n"\n\nmsgid "Back"\nmsgstr "Zurück"\n'
    )
    words = Words(catalogue)
    assert words.gettext("Back") == "Zurück"
    assert words.gettext("Continue") == "Continue"
