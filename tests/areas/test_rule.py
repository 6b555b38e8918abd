import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lubdub.areas.rule import Breastbone, distance_mm, place_areas, region_radius_mm, sigma_on_skin


def breastbone(length: float = 150.0, sigma: float = 5.0) -> Breastbone:
    apart = np.eye(2) * sigma**2
    return Breastbone(np.zeros(3), np.array([0.0, -length, 0.0]), apart, apart)


def test_an_adults_areas_stand_where_the_table_says() -> None:
    areas = place_areas(breastbone(), 40)
    assert areas["aortic"].position == pytest.approx([-25.5, -60, 0])
    assert areas["pulmonary"].position == pytest.approx([25.5, -60, 0])
    assert areas["tricuspid"].position == pytest.approx([33, -121.5, 0])
    assert areas["mitral"].position == pytest.approx([81, -159, 0])


@given(st.floats(0.3, 1.5))
def test_areas_scale_with_the_breastbone(scale: float) -> None:
    small, large = place_areas(breastbone(150 * scale), 40), place_areas(breastbone(150), 40)
    for name in large:
        assert np.allclose(small[name].position, scale * large[name].position)


def test_a_slanting_breastbone_takes_the_areas_along() -> None:
    bone = Breastbone(np.zeros(3), np.array([10.0, -150.0, -30.0]), 25 * np.eye(2), 25 * np.eye(2))
    aortic, pulmonary = (place_areas(bone, 40)[name].position for name in ("aortic", "pulmonary"))
    assert (aortic + pulmonary)[0] / 2 == pytest.approx(4.0)


def test_the_mitral_place_is_the_least_certain() -> None:
    areas = place_areas(breastbone(), 40)
    assert region_radius_mm(areas["mitral"].sigma_mm) == max(region_radius_mm(a.sigma_mm) for a in areas.values())


@given(st.floats(1, 15), st.floats(1, 15))
def test_worse_clicks_make_larger_regions(first: float, second: float) -> None:
    low, high = sorted((first, second))
    small, large = place_areas(breastbone(sigma=low), 40), place_areas(breastbone(sigma=high), 40)
    for name in small:
        assert region_radius_mm(small[name].sigma_mm) <= region_radius_mm(large[name].sigma_mm) + 1e-9


def test_ends_that_are_wrong_together_leave_places_between_them_less_sure_than_ends_wrong_by_themselves() -> None:
    apart, together = 25 * np.eye(2), 25 * np.array([[1.0, 0.9], [0.9, 1.0]])
    notch, joint = np.zeros(3), np.array([0.0, -150.0, 0.0])
    one, other = (place_areas(Breastbone(notch, joint, ends, ends), 40)["aortic"] for ends in (apart, together))
    assert (one.sigma_mm < other.sigma_mm).all()


@given(st.floats(0.5, 40), st.floats(0.2, 1.0))
def test_the_region_holds_nine_in_ten_of_what_it_describes(sigma: float, ratio: float) -> None:
    sigmas = np.array([sigma, sigma * ratio])
    drawn = np.random.default_rng(3).normal(size=(20000, 2)) * sigmas
    held = (np.linalg.norm(drawn, axis=1) < region_radius_mm(sigmas)).mean()
    assert held == pytest.approx(0.9, abs=0.012)


def test_the_distance_between_two_answers_is_that_of_their_worst_area() -> None:
    first = {name: estimate.position for name, estimate in place_areas(breastbone(), 40).items()}
    second = {**first, "mitral": first["mitral"] + [3.0, 4.0, 100.0]}
    assert distance_mm(first, second) == pytest.approx(5.0)


def test_a_region_on_sloping_skin_is_as_long_as_the_slope_makes_it() -> None:
    flat = sigma_on_skin(np.array([4.0, 6.0]), np.array([0.0, 0.0, 1.0]))
    assert np.allclose(np.sort(flat), [4.0, 6.0])
    half = np.sqrt(0.5)
    assert np.allclose(np.sort(sigma_on_skin(np.array([4.0, 6.0]), np.array([half, 0.0, half]))), [4 / half, 6.0])


def test_a_region_on_skin_seen_from_the_side_does_not_grow_without_end() -> None:
    side = sigma_on_skin(np.array([4.0, 6.0]), np.array([1.0, 0.0, 0.0]))
    assert side.max() < 4.0 * 3
