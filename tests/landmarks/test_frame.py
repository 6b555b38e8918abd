import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import Similarity
from lubdub.landmarks.frame import can_frame, frame_from_landmarks, long_axis
from lubdub.results import ScanRefused
from tests.bodies import torso_scan

BODY = torso_scan()
POINTS, NORMALS = BODY.surface.vertices, BODY.surface.normals
FIVE = dict(BODY.landmarks)
BONES = {name: FIVE[name] for name in ("suprasternal_notch", "xiphisternum", "navel")}
PAPERS = {name: FIVE[name] for name in ("navel", "nipple_left", "nipple_right")}


@pytest.mark.parametrize("known", [FIVE, BONES, PAPERS], ids=["five", "bones and navel", "the paper's three"])
def test_a_body_in_its_frame_is_turned_only_by_the_slope_of_its_chest(known: dict) -> None:
    move = frame_from_landmarks(known, POINTS, NORMALS)
    assert np.degrees(Rotation.from_matrix(move.rotation).magnitude()) < 12


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_any_rigid_motion_is_undone(seed: int) -> None:
    motion = Similarity(1.0, Rotation.random(random_state=seed).as_matrix(), np.array([300.0, -40.0, 900.0]))
    turned = {name: motion.apply(place) for name, place in FIVE.items()}
    back = frame_from_landmarks(turned, motion.apply(POINTS), motion.turn(NORMALS))
    straight = frame_from_landmarks(FIVE, POINTS, NORMALS)
    for name, place in turned.items():
        assert np.allclose(back.apply(place), straight.apply(FIVE[name]), atol=1e-6)


def test_the_notch_becomes_the_origin() -> None:
    assert np.allclose(frame_from_landmarks(FIVE, POINTS, NORMALS).apply(FIVE["suprasternal_notch"]), 0)


def test_swapped_nipples_are_refused() -> None:
    swapped = {**FIVE, "nipple_left": FIVE["nipple_right"], "nipple_right": FIVE["nipple_left"]}
    with pytest.raises(ScanRefused) as refusal:
        frame_from_landmarks(swapped, POINTS, NORMALS)
    assert refusal.value.reason.code == "sides_swapped"


def test_a_mirrored_scan_whose_left_is_the_patients_own_is_refused() -> None:
    flip = np.array([-1.0, 1.0, 1.0])
    mirrored = {name: place * flip for name, place in FIVE.items()}
    with pytest.raises(ScanRefused):
        frame_from_landmarks(mirrored, POINTS * flip, NORMALS * flip)


def test_points_on_one_spot_are_refused() -> None:
    with pytest.raises(ScanRefused):
        long_axis({"suprasternal_notch": np.zeros(3), "navel": np.zeros(3)})


@pytest.mark.parametrize(
    ("names", "enough"),
    [(("navel",), False), (("nipple_left", "navel"), False), (("suprasternal_notch", "xiphisternum"), True)],
)
def test_two_heights_on_the_midline_are_needed_for_a_frame(names: tuple[str, ...], enough: bool) -> None:
    assert can_frame({name: FIVE[name] for name in names}) is enough
