"""The table of OWASP ASVS items is whole, and every test it names exists."""

from __future__ import annotations

import re
import tomllib

import pytest

from tests.rules.source import PACKAGE, ROOT

TABLE = tomllib.loads((PACKAGE / "web" / "documents" / "asvs.toml").read_text())
LEVELS_1_AND_2 = """
1.1 1-2, 1.2 1-9, 1.3 1-11, 1.4 1-3, 1.5 1-2, 2.1 1-3, 2.2 1-3, 2.3 1-4, 2.4 1-1, 3.2 1-2, 3.3 1-4, 3.4 1-6, 3.5 1-5,
3.7 1-2, 4.1 1-3, 4.2 1-1, 4.3 1-2, 4.4 1-4, 5.1 1-1, 5.2 1-3, 5.3 1-2, 5.4 1-3, 6.1 1-3, 6.2 1-12, 6.3 1-4, 6.4 1-4,
6.5 1-5, 6.6 1-3, 6.8 1-4, 7.1 1-3, 7.2 1-4, 7.3 1-2, 7.4 1-5, 7.5 1-2, 7.6 1-2, 8.1 1-2, 8.2 1-3, 8.3 1-1, 8.4 1-1,
9.1 1-3, 9.2 1-4, 10.1 1-2, 10.2 1-2, 10.3 1-4, 10.4 1-11, 10.5 1-5, 10.6 1-2, 10.7 1-3, 11.1 1-2, 11.2 1-3, 11.3 1-3,
11.4 1-4, 11.5 1-1, 11.6 1-1, 12.1 1-3, 12.2 1-2, 12.3 1-4, 13.1 1-1, 13.2 1-5, 13.3 1-2, 13.4 1-5, 14.1 1-2, 14.2 1-4,
14.3 1-3, 15.1 1-3, 15.2 1-3, 15.3 1-7, 16.1 1-1, 16.2 1-5, 16.3 1-4, 16.4 1-3, 16.5 1-3, 17.1 1-1, 17.2 1-4, 17.3 1-2
"""
"""Section and the numbers of its items of levels 1 and 2; in each section they come before those of level 3."""


def expected() -> set[str]:
    found = re.findall(r"([\d.]+) (\d+)-(\d+)", LEVELS_1_AND_2)
    return {f"{section}.{number}" for section, first, last in found for number in range(int(first), int(last) + 1)}


def test_every_item_of_both_levels_stands_in_one_list_once() -> None:
    listed = [name for kind in ("shown", "open", "absent") for name in TABLE[kind]]
    assert len(listed) == len(set(listed))
    assert set(listed) == expected()
    assert all(re.fullmatch(r"\d{1,2}\.\d{1,2}\.\d{1,2}", name) for name in listed)


@pytest.mark.parametrize("item", TABLE["shown"])
def test_every_test_the_table_names_exists(item: str) -> None:
    words, *tests = TABLE["shown"][item]
    assert words
    assert tests
    for test in tests:
        path, name = test.split("::")
        assert f"def {name}(" in (ROOT / "tests" / path).read_text(), test


def test_what_is_open_or_absent_says_why() -> None:
    assert all(len(why) > 5 for kind in ("open", "absent") for why in TABLE[kind].values())
