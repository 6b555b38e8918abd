import numpy as np
import pytest

from lubdub.areas.anatomy import sternum_length_mm
from lubdub.areas.bones import believe
from lubdub.results import Landmark, Patient

NOTCH, JOINT = np.array([0.0, 0.0, 0.0]), np.array([0.0, -150.0, 10.0])
MAN = Patient(40, "male")


def clicked(notch: np.ndarray | None = NOTCH, joint: np.ndarray | None = JOINT, sigma: float = 6.0):
    places = {"suprasternal_notch": notch, "xiphisternum": joint}
    return {name: Landmark(place, "given", sigma) for name, place in places.items() if place is not None}


def test_clicks_alone_are_believed_as_they_are() -> None:
    bone = believe(clicked(), {}, MAN)
    assert np.allclose(bone.notch, NOTCH)
    assert np.allclose(bone.joint, JOINT)


def test_a_click_counts_more_than_a_fitted_bone() -> None:
    fitted = {"suprasternal_notch": NOTCH + [0, 30, 0], "xiphisternum": JOINT + [0, 30, 0]}
    bone = believe(clicked(), fitted, MAN)
    assert 0 < bone.notch[1] < 6


def test_without_clicks_the_fitted_bones_are_drawn_towards_the_length_for_the_age() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": NOTCH - [0, 110, 0]}
    bone = believe({}, fitted, MAN)
    assert 110 < bone.length_mm < sternum_length_mm(40, "male")


def test_one_click_and_the_age_give_the_other_end() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": NOTCH - [0, 190, 0]}
    with_click, without = believe(clicked(joint=None), fitted, MAN), believe({}, fitted, MAN)
    assert with_click.notch_sigma_mm[1] < without.notch_sigma_mm[1]
    assert with_click.joint[1] > fitted["xiphisternum"][1]


def test_two_clicks_are_never_bent_by_the_growth_table() -> None:
    odd = clicked(joint=np.array([0.0, -190.0, 0.0]))
    assert believe(odd, {}, MAN).length_mm == pytest.approx(190)


def test_agreeing_sources_make_us_surer() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    assert (believe(clicked(), fitted, MAN).joint_sigma_mm < believe(clicked(), {}, MAN).joint_sigma_mm).all()


def test_a_bone_nobody_knows_is_an_error() -> None:
    with pytest.raises(ValueError, match="xiphisternum"):
        believe(clicked(joint=None), {}, MAN)


def test_everything_scales_and_shifts_with_the_body() -> None:
    shift = np.array([3.0, -20.0, 8.0])
    bone = believe(clicked(NOTCH + shift, JOINT + shift), {}, MAN)
    assert np.allclose(bone.notch - shift, NOTCH)


def test_a_mans_nipples_pull_a_doubtful_notch_towards_a_breastbone_above_them() -> None:
    fitted = {"suprasternal_notch": NOTCH - [0, 40, 0], "xiphisternum": JOINT - [0, 40, 0]}
    sides = {"nipple_left": 1.0, "nipple_right": -1.0}
    nipples = {name: Landmark(np.array([90.0 * x, -155.0, 20.0]), "given", 5.0) for name, x in sides.items()}
    assert believe({}, fitted, MAN).notch[1] < believe(nipples, fitted, MAN).notch[1] < 10
    lying_woman = believe(nipples, fitted, Patient(40, "female")).notch[1]
    assert believe({}, fitted, Patient(40, "female")).notch[1] < lying_woman < believe(nipples, fitted, MAN).notch[1]
