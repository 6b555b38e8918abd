"""What must stand in no file: paths and hosts of one machine, unfinished work, keys."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.rules.source import ROOT, text_of, tracked_files

THIS = Path(__file__)
FORBIDDEN = {
    "a path of one machine": re.compile(r"(?<![\w.$}\"'/-])/(home|Users|root|work|mnt|media)/\w"),
    "a package registry's host": re.compile(
        r"pypi\.org|pythonhosted|registry\.npmjs|registry\.yarnpkg|artifactory|deb\.debian\.org|jsdelivr|unpkg\.com",
        re.I,
    ),
    "unfinished work": re.compile(
        r"\b(TODO|FIXME|XXX)\b|(?i:(#|//|\*|--|;)\s*(todo|fixme|xxx)\b)|"  # `todo` alone is Spanish for everything
        r"(?i:raise NotImplementedError|lorem ipsum|not implemented)"
    ),
    "a private key": re.compile(r"BEGIN (RSA |EC |OPENSSH )?PRIVATE KEY"),
}


@pytest.mark.parametrize("what", FORBIDDEN)
def test_no_file_holds(what: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:120]}"
        for path in tracked_files()
        if path != THIS and (text := text_of(path)) is not None
        for number, line in enumerate(text.splitlines(), 1)
        if FORBIDDEN[what].search(line)
    ]
    assert not found
