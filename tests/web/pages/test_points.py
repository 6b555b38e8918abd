"""Marking points by plain forms: what is taught, what is asked, what is said of odd points, and an unclear lie."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lubdub.cases.errors import FileNotFound
from lubdub.judging.reasons import LIE_UNCLEAR
from lubdub.report.archive import examination_to_bytes
from lubdub.results import LANDMARK_NAMES
from lubdub.web.pages.marks import Marks
from tests.views import sample
from tests.web.family import Family
from tests.web.service import Service, eventually

IN_FILE: dict[str, list[float]] = {name: (sample.BODY.landmarks[name] / 1000).tolist() for name in LANDMARK_NAMES}


@pytest.fixture
def family(service: Service) -> Family:
    return Family(service)


def mark(family: Family, case: str, **changes: str) -> None:
    """All five where they belong, or where the point named by a change belongs."""
    marks = Marks.from_bytes(family.vault.read(case, "marks.json"))
    placed = {name: IN_FILE[changes.get(name, name)] for name in LANDMARK_NAMES}
    family.vault.put(case, "marks.json", replace(marks, placed=placed, target=None).to_bytes())


def unclear(family: Family) -> str:
    """A case whose scan does not say how the body lies."""
    case = family.examined()
    seen = replace(sample.examination(), suggested={}, coverage=None, warnings=(LIE_UNCLEAR,))
    family.vault.put(case, "examination.npz", examination_to_bytes(seen))
    return case


def test_the_bones_are_taught_before_the_first_point_and_only_once(family: Family) -> None:
    case = family.examined()
    page = family.post(f"/cases/{case}/size", size="right", side="left")
    assert page.url.path == f"/cases/{case}/feel"
    assert "not the hollow" in page.text
    assert "/stickers.pdf" in page.text
    assert family.post(f"/cases/{case}/feel").url.path == f"/cases/{case}/points"
    assert "Feel the top of the breastbone" in family.get(f"/cases/{case}/points")


def test_what_skipping_costs_is_said_before_and_at_the_end(family: Family) -> None:
    case = family.confirmed()
    assert "does not count" in family.get(f"/cases/{case}/points")
    for name in LANDMARK_NAMES:
        family.post(f"/cases/{case}/points", action="choose", name=name)
        page = family.post(f"/cases/{case}/points", action="skip").text
    assert "All points are answered" in page
    assert "The result will say so" in page


def test_swapped_sides_are_said_on_the_page_and_stop_the_run_until_they_are_mended(family: Family) -> None:
    case = family.confirmed()
    mark(family, case, nipple_left="nipple_right", nipple_right="nipple_left")
    page = family.get(f"/cases/{case}/points")
    assert "Left and right seem swapped" in page
    assert "makes the places trustworthy" not in page
    assert 'value="done"' not in page
    assert "Look at the patient&#39;s left nipple again" in page
    stopped = family.post(f"/cases/{case}/points", 409, action="done").text
    assert "Left and right seem swapped" in stopped
    assert family.where(case) == "points"
    mark(family, case)
    family.locate(case)
    eventually(lambda: family.rest_status(case) == "done")


def test_a_script_is_told_what_to_mend_as_well(family: Family) -> None:
    case = family.confirmed()
    mark(family, case, navel="xiphisternum", xiphisternum="navel")
    answer = family.http.post(
        f"/cases/{case}/points",
        data={"csrf_token": family.token(), "action": "done"},
        headers={"Origin": family.service.settings.address, "Accept": "application/json"},
    )
    assert answer.status_code == 409
    assert "from the neck down" in answer.json()["detail"]


def test_points_that_fit_together_are_not_questioned(family: Family) -> None:
    case = family.confirmed()
    mark(family, case)
    page = family.get(f"/cases/{case}/points")
    assert "ask__odd" not in page
    assert "look again" not in page
    assert "makes the places trustworthy" in page


def test_an_unclear_lie_is_said_and_the_sides_are_asked_without_a_picture_of_them(family: Family) -> None:
    case = unclear(family)
    page = family.get(f"/cases/{case}/size")
    assert 'name="side"' not in page
    assert 'name="mirror"' in page
    family.post(f"/cases/{case}/size", 422, size="right")
    family.post(f"/cases/{case}/size", size="right", mirror="no")
    family.post(f"/cases/{case}/feel")
    page = family.get(f"/cases/{case}/points")
    assert "We could not tell which way the body lies. Please turn it and mark the points yourself." in page
    assert "We could not find it" in page
    assert 'value="roll"' in page


def test_a_mirrored_scan_of_unclear_lie_is_stopped(family: Family) -> None:
    case = unclear(family)
    assert "swapped in this scan" in family.post(f"/cases/{case}/size", size="right", mirror="yes").text


def test_an_unclear_lie_runs_with_enough_points_and_not_before(family: Family) -> None:
    case = unclear(family)
    family.post(f"/cases/{case}/size", size="right", mirror="no")
    family.post(f"/cases/{case}/feel")
    assert "cannot tell which way" in family.post(f"/cases/{case}/points", 409, action="done").text
    mark(family, case)
    family.locate(case)
    eventually(lambda: family.rest_status(case) == "done")
    asked = family.http.get(f"/api/v1/cases/{case}/result").json()["asked"]
    assert set(asked["landmarks"]) == set(LANDMARK_NAMES)


def test_a_picture_is_turned_by_quarters_and_its_points_stay_on_the_scan(family: Family) -> None:
    case = unclear(family)
    family.post(f"/cases/{case}/size", size="right", mirror="no")
    family.get(f"/view/{case}/")
    mark(family, case)
    for way in ("roll", "spin", "tip"):
        family.post(f"/cases/{case}/points", action=way)
    marks: dict[str, Any] = family.marks(case)
    assert marks["turns"] == ["roll", "spin", "tip"]
    np.testing.assert_allclose(marks["placed"]["navel"], IN_FILE["navel"])
    family.get(f"/view/{case}/0123abcd/")


def test_four_turns_the_same_way_are_none() -> None:
    marks = Marks()
    for _ in range(4):
        marks = marks.turned("roll")
    assert marks.turns == ()


def test_a_slide_without_a_picture_says_so(family: Family) -> None:
    case = family.confirmed()
    assert "not ready" in family.post(f"/cases/{case}/points", 409, action="slide", right="1", up="0").text


def test_marks_of_another_family_are_out_of_reach(family: Family, service: Service) -> None:
    case = family.confirmed()
    Family(service).get(f"/cases/{case}/feel", 404)
    with pytest.raises(FileNotFound):
        family.vault.read("0" * 32, "marks.json")


def test_without_scripts_there_is_no_button_that_does_nothing(family: Family) -> None:
    case = family.examined()
    family.post(f"/cases/{case}/size", size="right", side="left")
    assert 'id="tools" hidden' in family.post(f"/cases/{case}/feel").text
