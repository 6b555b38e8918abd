"""A made-up language to find what no translator could reach: every sentence between ⟦ and ⟧, longer, right to left.

It runs as Hebrew does, so that browsers lay it out from the right, but keeps Latin letters with accents.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po

from lubdub.web import languages
from lubdub.web.nhsuk import FRONTEND

CODE = "he"
HOLE = re.compile(r"(%\(\w+\)s|%%|\{\w*\}|<[^>]+>|&\w+;|\n)")
ACCENTS = str.maketrans("aeiounyAEIOUNY", "äëïöüñÿÄËÏÖÜÑŸ")
LONGER = 0.35
"""How much longer than English other languages run; single words more."""


def pseudo(sentence: str) -> str:
    """The sentence as it would be in a long, foreign language; what is filled in stays."""
    parts = [part if HOLE.fullmatch(part) else part.translate(ACCENTS) for part in HOLE.split(sentence)]
    words = re.sub(HOLE, "", sentence).split()
    longer = " ".join(word.translate(ACCENTS) for word in words[: round(LONGER * len(words))])
    return f"⟦{''.join(parts)} {longer}".rstrip() + "⟧"


def write_catalogue(folder: Path) -> None:
    """Every sentence in the made-up language, as `WORDS` of a service."""
    with (FRONTEND / "words" / "messages.pot").open("rb") as file:
        template = read_po(file)
    catalogue = Catalog(locale=CODE)
    for message in template:
        if isinstance(message.id, str):
            catalogue.add(message.id, pseudo(message.id) if message.id else "")
        else:
            catalogue.add(message.id, tuple(pseudo(message.id[1]) for _ in range(catalogue.num_plurals)))
    place = folder / CODE / "LC_MESSAGES" / "messages.po"
    place.parent.mkdir(parents=True)
    with place.open("wb") as written:
        write_po(written, catalogue)


def run(folder: str) -> None:
    """The web process, speaking the made-up language too."""
    from lubdub.settings import Settings
    from lubdub.web.serve import run_web

    languages.WORDS = Path(folder)
    languages.NAMES[CODE] = "⟦⟧"
    run_web(Settings())


if __name__ == "__main__":
    run(sys.argv[1])
