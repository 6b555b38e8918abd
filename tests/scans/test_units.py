"""The unit is found from how large people are, and never silently wrong."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lubdub.results import RawScan, ScanRefused, ScanUnreadable
from lubdub.scans.reasons import MARKS_IMPLAUSIBLE, UNIT_WRONG
from lubdub.scans.units import find_unit
from tests.bodies import BodyScan, add_bed, hide_side, rescale, torso_scan, turn

UNITS = ("m", "cm", "mm")
PAPERS_THREE = ("nipple_left", "nipple_right", "navel")


def small(size: float, breadth: float = 1.0) -> BodyScan:
    return torso_scan(size=size, breadth=breadth, columns=48, rows=44)


def raw(scan: BodyScan, unit_by_format: str | None = None) -> RawScan:
    return RawScan(scan.surface, "ply", unit_by_format)


@settings(max_examples=40, deadline=None)
@given(
    size=st.floats(0.32, 1.25),
    breadth=st.floats(0.85, 1.3),
    unit=st.sampled_from(UNITS),
    damage=st.sampled_from([lambda s: s, hide_side, lambda s: add_bed(hide_side(s)), lambda s: add_bed(s, under=True)]),
    turned=st.tuples(st.floats(-180, 180), st.floats(-180, 180), st.floats(-180, 180)),
)
def test_the_unit_is_found_from_newborn_to_large_adult(size, breadth, unit, damage, turned) -> None:
    scan = rescale(turn(damage(small(size, breadth)), turned), unit)
    paper = {name: scan.landmarks[name] for name in PAPERS_THREE}
    for landmarks in ({}, paper, scan.landmarks):
        found = find_unit(raw(scan), None, landmarks)
        assert (found.name, found.source) == (unit, "found")


@pytest.mark.parametrize("unit", UNITS)
def test_what_was_said_wins(unit: str) -> None:
    found = find_unit(raw(rescale(small(1.0), unit)), unit, {})
    assert (found.name, found.source) == (unit, "given")


@pytest.mark.parametrize(("written", "said"), [("m", "mm"), ("mm", "m"), ("cm", "m"), ("m", "cm")])
def test_a_stated_unit_that_makes_an_impossible_body_is_refused(written: str, said: str) -> None:
    scan = rescale(small(0.6), written)
    for landmarks in ({}, scan.landmarks):
        with pytest.raises(ScanRefused) as caught:
            find_unit(raw(scan), said, landmarks)
        assert caught.value.reason == UNIT_WRONG


@pytest.mark.parametrize("written", UNITS)
def test_a_glb_that_is_not_in_metres_is_found_out(written: str) -> None:
    found = find_unit(raw(rescale(small(1.0), written), unit_by_format="m"), None, {})
    assert (found.name, found.source) == (written, "found")


@pytest.mark.parametrize("size", [0.02, 12.0])
def test_a_doll_and_a_statue_are_refused(size: float) -> None:
    scan = rescale(small(size), "m")
    with pytest.raises(ScanRefused) as caught:
        find_unit(raw(scan, unit_by_format="m"), None, scan.landmarks)
    assert caught.value.reason.code == "unit_implausible"


@pytest.mark.parametrize("unit", [None, "m", "cm", "mm"])
@pytest.mark.parametrize("name", ["navel", "xiphisternum"])
def test_a_point_where_no_person_has_one_is_blamed_on_the_points_and_not_on_the_unit(unit, name) -> None:
    scan = rescale(small(1.0), unit or "mm")
    notch = scan.landmarks["suprasternal_notch"]
    in_the_air = notch + 9 * (scan.landmarks["navel"] - notch)
    with pytest.raises(ScanRefused) as caught:
        find_unit(raw(scan), unit, {**scan.landmarks, name: in_the_air})
    assert caught.value.reason == MARKS_IMPLAUSIBLE


@pytest.mark.parametrize("said", ["m", "cm"])
def test_points_that_fit_another_unit_are_no_reason_to_doubt_them(said: str) -> None:
    scan = rescale(small(0.5), "mm")
    with pytest.raises(ScanRefused) as caught:
        find_unit(raw(scan), said, scan.landmarks)
    assert caught.value.reason == UNIT_WRONG


def test_a_size_that_two_units_would_explain_is_refused() -> None:
    cube = np.random.default_rng(0).random((2000, 3)) * [120, 90, 70]
    scan = RawScan(torso_scan(columns=8, rows=8).surface.__class__(cube, np.zeros((0, 3))), "xyz")
    with pytest.raises(ScanRefused):
        find_unit(scan, None, {})


def test_stray_points_far_away_do_not_change_the_unit() -> None:
    scan = rescale(small(1.0), "m")
    far = np.random.default_rng(0).normal(0, 30, (10, 3))
    surface = scan.surface.__class__(np.concatenate([scan.surface.vertices, far]), scan.surface.triangles)
    assert find_unit(RawScan(surface, "ply"), None, {}).name == "m"


def test_an_unknown_unit_is_a_wrong_use() -> None:
    with pytest.raises(ScanUnreadable, match="m, cm or mm"):
        find_unit(raw(small(1.0)), "inch", {})
