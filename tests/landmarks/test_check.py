from dataclasses import replace

import numpy as np
import pytest

from lubdub.geometry.frames import Similarity
from lubdub.landmarks.check import check_landmarks
from lubdub.results import CleanScan, ScanRefused, Unit
from tests.bodies import torso_scan

BODY = torso_scan()
FIVE = dict(BODY.landmarks)
SCAN = CleanScan(
    BODY.surface.vertices,
    BODY.surface.normals,
    np.zeros(len(BODY.surface.vertices), bool),
    lambda: BODY.surface,
    Similarity.identity(),
    Unit("mm", 1.0, "given"),
)


def refusal_code(landmarks: dict, expected: float | None = 150.0) -> str:
    with pytest.raises(ScanRefused) as refusal:
        check_landmarks(SCAN, landmarks, expected)
    return refusal.value.reason.code


def test_a_plausible_body_raises_nothing() -> None:
    assert check_landmarks(SCAN, FIVE, 150.0) == ()


def test_a_point_in_the_air_is_refused() -> None:
    assert refusal_code({**FIVE, "navel": FIVE["navel"] + [0, 0, 60]}) == "landmark_off_body"


def test_the_lower_end_above_the_upper_one_is_refused() -> None:
    swapped = {**FIVE, "suprasternal_notch": FIVE["xiphisternum"], "xiphisternum": FIVE["suprasternal_notch"]}
    assert refusal_code(swapped) == "points_out_of_order"


def test_a_grown_ups_breastbone_on_a_toddler_is_refused() -> None:
    assert refusal_code(FIVE, expected=72.0) == "breastbone_implausible"


def test_the_hollow_instead_of_the_bone_is_noticed_when_the_length_gives_it_away() -> None:
    assert [reason.code for reason in check_landmarks(SCAN, FIVE, 113.0)] == ["breastbone_unusual"]


def test_a_nipple_on_the_midline_is_refused() -> None:
    middle = BODY.surface.vertices[np.abs(BODY.surface.vertices - [5, -158, 100]).sum(1).argmin()]
    assert refusal_code({**FIVE, "nipple_left": middle}) == "landmarks_implausible"


def test_a_navel_on_the_chest_is_refused_even_when_the_age_is_unknown() -> None:
    high = BODY.surface.vertices[np.abs(BODY.surface.vertices - [0, -165, 110]).sum(1).argmin()]
    assert refusal_code({**FIVE, "navel": high}, expected=None) == "landmarks_implausible"


def test_a_single_nipple_beyond_the_midline_is_refused() -> None:
    crossed = {"suprasternal_notch": FIVE["suprasternal_notch"], "nipple_left": FIVE["nipple_right"]}
    assert refusal_code(crossed) == "sides_swapped"


def test_a_single_nipple_without_a_midline_contradicts_nothing() -> None:
    assert check_landmarks(SCAN, {"nipple_left": FIVE["nipple_right"]}, 150.0) == ()


@pytest.mark.parametrize(
    ("expected", "codes"), [(150.0, []), (75.0, ["landmarks_unusual"])], ids=["right age", "wrong age"]
)
def test_without_the_notch_nipples_and_navel_tell_an_age_that_cannot_be(expected: float, codes: list[str]) -> None:
    three = {name: FIVE[name] for name in ("navel", "nipple_left", "nipple_right")}
    assert [reason.code for reason in check_landmarks(SCAN, three, expected)] == codes


def test_a_bigger_body_with_a_bigger_breastbone_is_as_plausible() -> None:
    scale = 0.5
    small = {name: place * scale for name, place in FIVE.items()}
    scan = replace(SCAN, points=SCAN.points * scale)
    assert check_landmarks(scan, small, 75.0) == ()
