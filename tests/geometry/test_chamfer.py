import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lubdub.geometry.chamfer import chamfer_mm, one_way_mm
from tests.overlays import motion


def some_points(seed: int, count: int = 60) -> np.ndarray:
    return 100 * np.random.default_rng(seed).standard_normal((count, 3))


seeds = st.integers(0, 10_000)


@given(seeds, seeds)
def test_the_distance_is_the_same_both_ways(first: int, second: int) -> None:
    a, b = some_points(first, 40), some_points(second, 75)
    assert chamfer_mm(a, b) == pytest.approx(chamfer_mm(b, a))


@given(seeds)
def test_a_set_is_at_no_distance_from_itself_in_any_order(seed: int) -> None:
    points = some_points(seed)
    assert chamfer_mm(points, np.random.default_rng(seed).permutation(points)) == 0


@given(seeds, st.floats(-180, 180))
def test_moving_both_sets_together_changes_nothing(seed: int, degrees: float) -> None:
    a, b = some_points(seed), some_points(seed + 1)
    moved = motion(degrees, (1, -2, 0.5), (300, -20, 7))
    assert chamfer_mm(moved.apply(a), moved.apply(b)) == pytest.approx(chamfer_mm(a, b), rel=1e-9)


def test_the_answer_is_a_mean_so_that_a_denser_set_is_not_farther() -> None:
    line = np.stack([np.linspace(0, 1000, 11), np.zeros(11), np.zeros(11)], axis=1)
    beside = line + [0, 7, 0]
    assert chamfer_mm(line, beside) == pytest.approx(7)
    assert chamfer_mm(np.repeat(line, 20, axis=0), beside) == pytest.approx(7)


def test_the_first_term_looks_from_the_first_set_at_the_second() -> None:
    near, far = np.zeros((1, 3)), np.array([[0.0, 0, 0], [10, 0, 0]])
    assert one_way_mm(near, far) == 0
    assert one_way_mm(far, near) == pytest.approx(5)
    assert chamfer_mm(near, far) == pytest.approx(2.5)


def test_trimming_leaves_out_what_only_one_set_covers() -> None:
    shared = some_points(1, 90)
    more = np.concatenate([shared, shared[:10] + 5000])
    assert chamfer_mm(more, shared) > 100
    assert chamfer_mm(more, shared, keep=0.9) == 0


@pytest.mark.parametrize("keep", [0.0, -1.0, 1.5])
def test_an_impossible_share_is_refused(keep: float) -> None:
    with pytest.raises(ValueError, match="keep"):
        chamfer_mm(some_points(1), some_points(2), keep)


def test_an_empty_set_has_no_distance() -> None:
    with pytest.raises(ValueError, match="empty"):
        chamfer_mm(np.zeros((0, 3)), some_points(1))
