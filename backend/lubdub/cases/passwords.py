"""What a password must be: long enough, hard to guess, and more than words of the house. No rule says which signs."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal

from zxcvbn import zxcvbn

SHORTEST_PASSWORD, LONGEST_PASSWORD = 12, 200
LEAST_SCORE = 3
"""Of 4: it takes more than 10^8 guesses (Wheeler, zxcvbn: low-budget password strength estimation, 2016)."""
LOOKED_AT = 72
"""Signs; what is longer cannot be made easier to guess by what comes behind them, and looking takes time."""
HOUSE = ("lubdub",)
SHORTEST_WORD = 4

Fault = Literal["length", "own", "common"]


def fault_of(password: str, own: Iterable[str] = ()) -> Fault | None:
    """What is wrong with a password that somebody chooses. own: the person's name, e-mail and organisation."""
    if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
        return "length"
    left = _without(password, words_of_house(own))
    if len(left) < SHORTEST_PASSWORD:
        return "own"
    if zxcvbn(left[:LOOKED_AT])["score"] < LEAST_SCORE:
        return "common"
    return None


def words_of_house(own: Iterable[str]) -> set[str]:
    """The words that count for nothing in a password, in small letters."""
    found = (word for text in own for word in re.findall(r"[^\W_]+", text.casefold()))
    return {*HOUSE, *(word for word in found if len(word) >= SHORTEST_WORD)}


def _without(password: str, words: Iterable[str]) -> str:
    longest_first = sorted(words, key=len, reverse=True)
    return re.sub("|".join(map(re.escape, longest_first)), "", password, flags=re.IGNORECASE)
