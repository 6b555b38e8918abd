"""The finished result as one file."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from lubdub.results import AREA_NAMES
from lubdub.views.export import STATIC_POLICY, result_html
from lubdub.views.scene import VIEW
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


def test_the_panel_and_the_viewers_own_english_are_hidden(page: str) -> None:
    hidden = re.search(r"<style>([^{]*)\{display:none!important\}", page)
    assert hidden is not None
    assert {".mantine-Paper-root", "noscript"} <= set(hidden.group(1).split(","))


def test_a_refused_case_without_a_scan_has_no_picture() -> None:
    with pytest.raises(ValueError, match="no scan"):
        result_html(replace(sample.outcome(), scan=None, areas={}))


def test_the_file_knows_where_to_stand_for_each_place(page: str) -> None:
    found = re.search(r'id="lubdub-views">(.*?)</script>', page)
    assert found is not None
    views = json.loads(found.group(1))
    assert set(views) == {"all", *AREA_NAMES}
    whole = np.linalg.norm(np.subtract(views["all"]["eye"], views["all"]["target"]))
    for name in AREA_NAMES:
        eye, target = np.array(views[name]["eye"]), np.array(views[name]["target"])
        place = sample.outcome().areas[name].position * VIEW
        assert np.linalg.norm(eye - target) < 0.8 * whole
        assert np.linalg.norm(target - place) < np.linalg.norm(np.array(views["all"]["target"]) - place)
        assert eye[2] > target[2]
