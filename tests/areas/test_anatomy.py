import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lubdub.areas.anatomy import (
    MITRAL,
    MITRAL_UNDER_FOUR,
    age_from_sternum,
    places,
    sternum_length_mm,
)


@pytest.mark.parametrize("age", [0.0, 1.5, 3.9])
def test_under_four_the_apex_lies_in_the_fourth_space(age: float) -> None:
    assert places(age)["mitral"] == MITRAL_UNDER_FOUR


@pytest.mark.parametrize("age", [7.0, 12.0, 80.0])
def test_from_seven_on_the_apex_lies_in_the_fifth_space(age: float) -> None:
    assert places(age)["mitral"] == MITRAL


@pytest.mark.parametrize(("age", "share"), [(4.0, 0.92), (5.0, 0.51), (6.0, 0.14)])
def test_between_four_and_seven_the_apex_moves_down_as_children_were_found_to(age: float, share: float) -> None:
    expected = share * MITRAL_UNDER_FOUR.below + (1 - share) * MITRAL.below
    assert places(age)["mitral"].below == pytest.approx(expected)


def test_the_doubt_about_the_apex_is_largest_when_half_the_children_have_moved() -> None:
    assert places(5.0)["mitral"].spread_below > places(9.0)["mitral"].spread_below


@given(st.floats(0, 100))
def test_the_aortic_place_is_on_the_right_and_the_others_on_the_left(age: float) -> None:
    table = places(age)
    assert table["aortic"].left < 0 < min(table[name].left for name in ("pulmonary", "tricuspid", "mitral"))


@given(st.floats(0, 16.9), st.sampled_from(["male", "female", None]))
def test_a_childs_breastbone_grows_with_age(age: float, sex: str | None) -> None:
    assert sternum_length_mm(age, sex) < sternum_length_mm(age + 1, sex)


@pytest.mark.parametrize(("age", "boys", "girls"), [(1, 66, 63), (5, 88, 86), (10, 117, 109), (15, 145, 125)])
def test_breastbone_lengths_are_those_of_the_ct_study(age: float, boys: float, girls: float) -> None:
    assert sternum_length_mm(age, "male") == pytest.approx(boys, abs=1)
    assert sternum_length_mm(age, "female") == pytest.approx(girls, abs=1)


def test_a_newborns_apex_lies_as_far_from_the_midline_as_newborns_were_measured() -> None:
    assert places(0.0)["mitral"].left * sternum_length_mm(0.0, "male") == pytest.approx(28, abs=1)


@given(st.floats(1, 17))
def test_age_and_breastbone_are_each_others_inverse_for_boys(age: float) -> None:
    assert np.isclose(age_from_sternum(sternum_length_mm(age, "male")), age, atol=1e-6)
