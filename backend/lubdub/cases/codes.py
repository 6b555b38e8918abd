"""Codes a person can type: made of letters and digits that are not taken for one another, kept as hashes."""

from __future__ import annotations

import hashlib
import secrets

ALPHABET = "ABCDEFGHJKMNPQRSTVWXYZ23456789"
"""Letters and digits that are not taken for one another; U is left out so that no word is spelled."""
GROUPS, GROUP = 4, 4
"""16 signs of 30: 78 bits, which nobody guesses."""


def new_code() -> str:
    """Groups of signs with hyphens between them."""
    return "-".join("".join(secrets.choice(ALPHABET) for _ in range(GROUP)) for _ in range(GROUPS))


def code_sha256(purpose: str, code: str) -> str:
    """As codes are stored, apart for each purpose. Small letters, spaces and missing hyphens are forgiven."""
    plain = "".join(sign for sign in code.upper() if sign.isalnum())
    return hashlib.sha256(f"lubdub {purpose}\0{plain}".encode()).hexdigest()
