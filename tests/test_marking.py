"""What is said about points while they are placed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lubdub.marking import look_over
from lubdub.results import Examination, LandmarkName, Patient
from tests.views import sample

CHILD = Patient(6.0, "female")
SEEN = sample.examination()
IN_FILE = {name: place / 1000 for name, place in sample.BODY.landmarks.items()}


def found(
    in_file: dict[LandmarkName, np.ndarray], patient: Patient = CHILD, seen: Examination = SEEN
) -> dict[str, bool]:
    return {oddity.what: oddity.is_grave for oddity in look_over(seen, in_file, patient)}


def swapped(first: LandmarkName, second: LandmarkName) -> dict[LandmarkName, np.ndarray]:
    return {**IN_FILE, first: IN_FILE[second], second: IN_FILE[first]}


@pytest.mark.parametrize("names", [(), ("navel",), ("suprasternal_notch", "xiphisternum"), tuple(IN_FILE)], ids=len)
def test_right_points_are_not_questioned(names: tuple[LandmarkName, ...]) -> None:
    assert found({name: IN_FILE[name] for name in names}) == {}


def test_swapped_nipples_are_grave() -> None:
    assert found(swapped("nipple_left", "nipple_right"))["sides"]


def test_one_nipple_on_the_other_side_is_noticed_before_there_is_a_second() -> None:
    assert "sides" in found({"nipple_left": IN_FILE["nipple_right"]})


def test_the_two_bones_the_wrong_way_round_are_noticed_at_once() -> None:
    bones = {
        name: swapped("suprasternal_notch", "xiphisternum")[name] for name in ("suprasternal_notch", "xiphisternum")
    }
    assert "order" in found(bones)


def test_one_point_far_from_where_it_can_be_is_questioned() -> None:
    assert found({"suprasternal_notch": IN_FILE["navel"]}) == {"far": False}


def test_a_breastbone_too_long_for_the_age_is_grave() -> None:
    assert found(IN_FILE, Patient(0.2, "female"))["bone_long"]


def test_a_belly_button_on_the_chest_is_grave_and_named() -> None:
    high = {**IN_FILE, "navel": IN_FILE["xiphisternum"] + [0, -0.006, 0]}
    odd = {oddity.what: oddity for oddity in look_over(SEEN, high, CHILD)}
    assert odd["navel"].is_grave
    assert "navel" in odd["navel"].names


@pytest.mark.parametrize(
    ("name", "moved"),
    [
        ("suprasternal_notch", [77, -34.8, 36]),
        ("xiphisternum", [77, -34.8, 36]),
        ("xiphisternum", [57, -300, 36]),
        ("navel", [77, -34.8, 36]),
    ],
)
def test_of_points_that_contradict_each_other_the_one_far_from_its_place_is_named_first(
    name: LandmarkName, moved: list[float]
) -> None:
    first = look_over(SEEN, {**IN_FILE, name: np.array(moved) / 1000}, CHILD)[0]
    assert first.is_grave
    assert first.names[0] == name


def test_swapped_sides_are_said_before_a_point_that_is_merely_far_off() -> None:
    assert list(found({"nipple_left": IN_FILE["nipple_right"]})) == ["sides", "far"]


def test_what_only_the_shape_contradicts_does_not_stop_anybody() -> None:
    turned = {name: replace(mark, position=mark.position * [1, -1, 1]) for name, mark in SEEN.suggested.items()}
    assert not any(found(IN_FILE, seen=replace(SEEN, suggested=turned)).values())


def test_without_suggestions_the_points_are_judged_among_themselves() -> None:
    unclear = replace(SEEN, suggested={})
    assert found(IN_FILE, seen=unclear) == {}
    assert found(swapped("nipple_left", "nipple_right"), seen=unclear)["sides"]
