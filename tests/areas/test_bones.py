import numpy as np
import pytest

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
    assert 0 < bone.notch[1] < 15
    assert 0 < bone.joint[1] - JOINT[1] < 15


def test_the_midline_of_a_symmetric_body_counts_more_than_a_click_beside_it() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    beside = clicked(NOTCH + [10.0, 0, 0], JOINT)
    assert 0 < believe(beside, fitted, MAN).notch[0] < 5


def test_without_clicks_the_fitted_bones_are_believed_with_doubt() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    bone = believe({}, fitted, MAN)
    assert np.allclose(bone.joint, JOINT)
    assert bone.along_mm2[1, 1] ** 0.5 > 15


def test_of_a_fitted_body_the_notch_is_surer_than_the_lower_end_of_which_skin_shows_nothing() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    bone = believe({}, fitted, MAN)
    assert bone.along_mm2[0, 0] < 0.5 * bone.along_mm2[1, 1]


def test_a_body_shown_to_be_fitted_too_high_at_one_end_is_believed_to_be_too_high_at_the_other() -> None:
    fitted = {"suprasternal_notch": NOTCH + [0, 20, 0], "xiphisternum": JOINT + [0, 20, 0]}
    bone = believe(clicked(joint=None), fitted, MAN)
    assert JOINT[1] < bone.joint[1] < fitted["xiphisternum"][1] - 5


def test_breasts_make_fitted_bones_less_sure() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    woman = believe({}, fitted, Patient(40, "female"))
    assert woman.along_mm2[1, 1] > believe({}, fitted, MAN).along_mm2[1, 1]


def test_one_click_makes_its_own_end_surer_and_the_other_a_little() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    with_click, without = believe(clicked(joint=None), fitted, MAN), believe({}, fitted, MAN)
    gain = np.diag(with_click.along_mm2) / np.diag(without.along_mm2)
    assert gain[0] < gain[1] < 1


def test_two_clicks_without_a_body_are_a_plain_ruler() -> None:
    odd = clicked(joint=np.array([0.0, -190.0, 0.0]))
    assert believe(odd, {}, MAN).length_mm == pytest.approx(190)


def test_agreeing_sources_make_us_surer() -> None:
    fitted = {"suprasternal_notch": NOTCH, "xiphisternum": JOINT}
    both, clicks = believe(clicked(), fitted, MAN), believe(clicked(), {}, MAN)
    assert (np.diag(both.along_mm2) < np.diag(clicks.along_mm2)).all()
    assert (np.diag(both.across_mm2) < np.diag(clicks.across_mm2)).all()


def test_a_bone_nobody_knows_is_an_error() -> None:
    with pytest.raises(ValueError, match="xiphisternum"):
        believe(clicked(joint=None), {}, MAN)


def test_everything_scales_and_shifts_with_the_body() -> None:
    shift = np.array([3.0, -20.0, 8.0])
    bone = believe(clicked(NOTCH + shift, JOINT + shift), {}, MAN)
    assert np.allclose(bone.notch - shift, NOTCH)
