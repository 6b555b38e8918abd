"""Where chance, hashes and ciphers come from, read from the sources; and the inventory of them is whole."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator

import pytest

from lubdub.cases import codes, credentials, passkeys, people, sealing
from tests.rules.source import PACKAGE, Module, imports, modules

INVENTORY = (PACKAGE / "web" / "documents" / "ciphers.html").read_text()
WITH_SECRETS = {"cases", "jobs", "web", "commands"}
HASHES = {"sha256", "file_digest"}
KNOWN = {
    "cryptography.exceptions.InvalidTag": "AES-GCM",
    "cryptography.hazmat.primitives.ciphers.aead.AESGCM": "AES-GCM",
    "cryptography.hazmat.primitives.hashes.SHA1": "HMAC-SHA-1",
    "cryptography.hazmat.primitives.hashes.SHA256": "SHA-256",
    "cryptography.hazmat.primitives.kdf.hkdf.HKDF": "HKDF",
    "cryptography.hazmat.primitives.twofactor.InvalidToken": "TOTP",
    "cryptography.hazmat.primitives.twofactor.totp.TOTP": "TOTP",
    "hashlib": "SHA-256",
    "hmac": "HMAC-SHA-256",
    "joserfc": "ES256",
    "pwdlib": "Argon2id",
    "standardwebhooks": "HMAC-SHA-256",
    "webauthn": "Passkeys",
}
"""What the package imports for keeping secrets -> by which words the inventory tells of it."""
LIBRARIES = {name.partition(".")[0] for name in KNOWN} | {"Crypto", "nacl", "OpenSSL", "jwt", "bcrypt", "passlib"}


def calls(module: Module) -> Iterator[tuple[str, str]]:
    """`hashlib.sha256(...)` as (hashlib, sha256)."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            yield node.value.id, node.attr


def test_no_secret_comes_from_a_source_that_can_be_foretold() -> None:
    foretold = [
        f"{module}: {name}"
        for module in modules()
        if module.room in WITH_SECRETS
        for _line, name in imports(module)
        if name.split(".")[0] == "random" or name.startswith("numpy.random")
    ]
    assert foretold == []


def test_hashes_are_sha_256_but_inside_the_codes_of_apps() -> None:
    used = {(str(module), name) for module in modules() for owner, name in calls(module) if owner == "hashlib"}
    assert {name for _module, name in used} <= HASHES
    weak = {str(m) for m in modules() for _line, name in imports(m) if re.search(r"\.(SHA1|MD5)$", name)}
    assert weak == {"backend/lubdub/cases/credentials.py"}


def test_every_cipher_the_package_imports_stands_in_the_inventory() -> None:
    imported = {name for module in modules() for _line, name in imports(module) if name.split(".")[0] in LIBRARIES}
    unknown = {name for name in imported if name not in KNOWN and name.split(".")[0] not in KNOWN}
    assert unknown == set()
    assert [said for said in KNOWN.values() if said not in INVENTORY] == []


@pytest.mark.parametrize(
    ("bits", "least"),
    [
        (8 * people.TOKEN_BYTES, 256),
        (8 * passkeys.CHALLENGE_BYTES, 256),
        (8 * sealing.KEY_BYTES, 256),
        (8 * credentials.SECRET_BYTES, 160),
        (codes.GROUPS * codes.GROUP * math.log2(len(codes.ALPHABET)), 78),
    ],
    ids=["tokens, links and keys of portals", "challenges", "keys of files", "seeds of code apps", "spare codes"],
)
def test_a_secret_is_long_enough(bits: float, least: float) -> None:
    assert bits >= least


def test_a_spare_code_is_as_long_as_is_said() -> None:
    made = credentials.new_recovery_codes()
    assert len(set(made)) == credentials.RECOVERY_CODES
    assert all(re.fullmatch(rf"(?:[{codes.ALPHABET}]{{4}}-){{3}}[{codes.ALPHABET}]{{4}}", one) for one in made)
