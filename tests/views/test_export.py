"""The finished result as one file."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from lubdub.views.export import STATIC_POLICY, result_html
from tests.views import sample


@pytest.fixture(scope="module")
def page() -> str:
    return result_html(sample.outcome(), 6.0)


def test_the_file_carries_its_scene_and_its_own_policy(page: str) -> None:
    assert "__VISER_EMBED_DATA__" in page
    assert f'http-equiv="Content-Security-Policy" content="{STATIC_POLICY}"' in page


def test_the_policy_lets_the_file_reach_nobody() -> None:
    assert "default-src 'none'" in STATIC_POLICY
    assert re.search(r"connect-src blob: data:;", STATIC_POLICY)
    assert not re.search(r"https?:|wss?:|'self'|\*", STATIC_POLICY)


def test_the_file_names_nothing_to_load_from_elsewhere(page: str) -> None:
    assert not re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=[\"']?(?!data:|blob:)[^\"'> ]+", page[:5000])


def test_the_panel_is_hidden(page: str) -> None:
    assert ".mantine-Paper-root" in page


def test_a_refused_case_without_a_scan_has_no_picture() -> None:
    with pytest.raises(ValueError, match="no scan"):
        result_html(replace(sample.outcome(), scan=None, areas={}))
