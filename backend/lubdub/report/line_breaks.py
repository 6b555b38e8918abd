"""Where a line of Japanese may end: between phrases, never before a full stop or inside a word."""

from __future__ import annotations

import re
from collections.abc import Callable

KANA = "ぁ-ん"
OTHER = rf"[^{KANA}、。：？！（）「」『』\s]"
PHRASE = re.compile(
    rf"[（「『]*(?:{OTHER}|(?<=\d)[ \u00a0](?=[\w%]))*"  # what it is about; a number and its unit stay together
    rf"[{KANA}]*(?:(?<=[おご]){OTHER}+[{KANA}]*)?"  # its endings; polite words begin with お or ご
    rf"(?:[）」』]+[{KANA}]*)*[、。：？！]*\s*"
)
"""Endings and particles are written in Hiragana, what they belong to in other letters: so after them a phrase ends."""


def phrases(text: str) -> list[str]:
    """The text's phrases in order; joined they are the text."""
    return [found for found in PHRASE.findall(text) if found]


def broken(text: str, width: float, length_of: Callable[[str], float]) -> str:
    """The text with line ends so that each line is at most so wide, if its phrases are. length_of: as wide as width."""
    lines = [""]
    for phrase in phrases(text):
        if lines[-1] and length_of((lines[-1] + phrase).rstrip()) > width:
            lines.append("")
        lines[-1] += phrase
    return "\n".join(line.rstrip() for line in lines)
