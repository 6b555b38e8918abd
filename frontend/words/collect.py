"""Collects every sentence that can be shown to a family into messages.pot, and brings each language up to date.

From the project folder: PYTHONPATH=backend .venv/bin/python frontend/words/collect.py
"""

from __future__ import annotations

import importlib
import io
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_dir
from babel.messages.frontend import parse_mapping_cfg
from babel.messages.pofile import read_po, write_po

from lubdub.results import Reason

WORDS = Path(__file__).parent
ROOT = WORDS.parent.parent
ROOMS = ROOT / "backend" / "lubdub"
EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
"""Written as the time of making, so that the same sentences are the same bytes."""
MAINTAINERS = "Lubdub maintainers"
"""Whom to tell of a mistake: the same in every language, and nobody's address."""
KEYWORDS = {"_": None, "gettext": None, "ngettext": (1, 2)}


def collected() -> Catalog:
    """Every sentence: of pages and sheets, and of the reasons that the rooms behind them give."""
    catalogue = Catalog(project="Lubdub", charset="utf-8", creation_date=EPOCH)
    for message in [*_on_pages(), *_in_reasons()]:
        catalogue.add(message)
    return catalogue


def _on_pages() -> Iterator[str | tuple[str, ...]]:
    with (WORDS / "babel.cfg").open(encoding="utf-8") as file:
        methods, _options = parse_mapping_cfg(file)
    for folder in sorted({pattern.rpartition("/")[0].partition("*")[0].rstrip("/") for pattern, _ in methods}):
        within = [(pattern.removeprefix(folder + "/"), how) for pattern, how in methods if pattern.startswith(folder)]
        for _file, _line, message, _comments, _context in extract_from_dir(ROOT / folder, within, {}, KEYWORDS):
            yield message if isinstance(message, str) else tuple(message)


def _in_reasons() -> Iterator[str]:
    for path in sorted(ROOMS.rglob("*.py")):
        if "Reason(" not in path.read_text(encoding="utf-8"):
            continue
        module = importlib.import_module(".".join(path.relative_to(ROOMS.parent).with_suffix("").parts))
        for value in vars(module).values():
            reasons = value.values() if isinstance(value, Mapping) else [value]
            for reason in reasons:
                if isinstance(reason, Reason):
                    yield from (reason.message, reason.advice)


def _write(place: Path, catalogue: Catalog) -> None:
    catalogue.header_comment = "# Sentences of Lubdub."
    catalogue.fuzzy = False
    catalogue.last_translator = catalogue.language_team = catalogue.msgid_bugs_address = MAINTAINERS
    written = io.BytesIO()
    write_po(written, catalogue, no_location=True, omit_header=place.suffix == ".pot", sort_output=True, width=100)
    place.write_bytes(written.getvalue())


def main() -> None:
    """Write the template, then merge it into every language: what is new is empty there, what is gone goes."""
    template = collected()
    _write(WORDS / "messages.pot", template)
    for place in sorted(WORDS.glob("*/LC_MESSAGES/messages.po")):
        language = place.parent.parent.name
        with place.open("rb") as file:
            known = read_po(file, locale=language)
        known.update(template, no_fuzzy_matching=True)
        known.obsolete.clear()
        _write(place, known)


if __name__ == "__main__":
    main()
