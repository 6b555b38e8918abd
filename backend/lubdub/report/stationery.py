"""Papers to print on and letters to print with: all that can be said of a sheet without loading the PDF library."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

Paper = Literal["a4", "letter"]
Style = Literal["", "B"]
PAPERS: dict[Paper, tuple[float, float]] = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}

WIDE_FONT = Path(__file__).parents[3] / "frontend" / "node_modules" / "@expo-google-fonts" / "biz-udpgothic"
"""Japanese letters, installed with the browser's parts; only those that are used go into a sheet."""
WIDE_FILES: dict[Style, str] = {"": "400Regular/BIZUDPGothic_400Regular.ttf", "B": "700Bold/BIZUDPGothic_700Bold.ttf"}
PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "...", "\u00a0": " "})
"""The typeface every PDF reader has knows no typographic quotes and dashes."""


class FontMissing(Exception):
    """The letters of this language are not installed. The text says what to do."""


def letters_for(text: str, style: Style = "B") -> Path | None:
    """The TrueType file that has the text's letters; None when the usual ones do. Raises FontMissing."""
    if _is_plain(text):
        return None
    file = WIDE_FONT / WIDE_FILES[style]
    if not file.is_file():
        raise FontMissing("The letters for this language are not installed. Run ./lubdub setup to fetch them.")
    return file


def _is_plain(text: str) -> bool:
    try:
        text.translate(PLAIN).encode("latin-1")
    except UnicodeEncodeError:
        return False
    return True
