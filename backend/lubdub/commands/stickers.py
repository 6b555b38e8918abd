"""`lubdub stickers`: the sheet with the two stickers, to print before a scan."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.locate import write_whole


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "stickers",
        help="the sheet of two stickers to print before a scan, as PDF",
        description="Writes a PDF with two round stickers for the ends of the breastbone. On a scan with colour they "
        "mark both bones, check the size and show whether it is mirrored. Print it at 100 %.",
        allow_abbrev=False,
    )
    parser.add_argument("--paper", choices=("a4", "letter"), default="a4")
    parser.add_argument("--size", choices=("large", "small"), default="large", help="small: for babies under one year")
    parser.add_argument("--language", default="en", metavar="CODE", help="of the words on it, such as en, ja or es")
    parser.add_argument("--out", type=Path, metavar="FILE.pdf", default=Path("stickers.pdf"))
    parser.set_defaults(run=_write)


def _write(typed: argparse.Namespace) -> int:
    from lubdub.report.stationery import FontMissing
    from lubdub.report.sticker_sheet import sticker_sheet, sticker_words
    from lubdub.web.languages import languages, words_of

    if typed.language not in languages():
        raise CommandFault(f"There is no language {typed.language}. There are: {', '.join(languages())}.")
    words = sticker_words(typed.size, words_of(typed.language).gettext)
    try:
        write_whole(typed.out, sticker_sheet(typed.paper, typed.size, words, typed.language))
    except FontMissing as error:
        raise CommandFault(str(error)) from error
    sys.stdout.write(f"Written to {typed.out}. Print it at 100 %, and measure the line on it: 50 mm.\n")
    return 0
