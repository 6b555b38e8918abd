import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import Similarity, body_axes


def some(seed: int) -> Similarity:
    rng = np.random.default_rng(seed)
    return Similarity(
        float(rng.uniform(0.001, 1000)), Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    )


POINTS = np.random.default_rng(0).normal(size=(20, 3))


@given(st.integers(0, 10**6))
def test_the_inverse_brings_points_back(seed: int) -> None:
    move = some(seed)
    assert np.allclose(move.inverse().apply(move.apply(POINTS)), POINTS)


@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_one_after_the_other_is_the_composition(first: int, second: int) -> None:
    a, b = some(first), some(second)
    assert np.allclose(b.after(a).apply(POINTS), b.apply(a.apply(POINTS)))


@given(st.integers(0, 10**6))
def test_a_matrix_and_back_is_the_same_move(seed: int) -> None:
    move = some(seed)
    assert np.allclose(Similarity.from_matrix(move.matrix()).apply(POINTS), move.apply(POINTS))


def test_a_mirroring_matrix_is_refused() -> None:
    with pytest.raises(ValueError, match="mirror"):
        Similarity.from_matrix(np.diag([-1.0, 1.0, 1.0, 1.0]))


def test_left_cross_head_is_front() -> None:
    left, head, front = body_axes(np.array([0.0, 2.0, 0.0]), np.array([0.3, 0.4, 5.0]))
    assert np.allclose(np.cross(left, head), front)
    assert np.allclose(head, [0, 1, 0])


def test_parallel_axes_are_an_error() -> None:
    with pytest.raises(ValueError, match="parallel"):
        body_axes(np.array([0.0, 1.0, 0.0]), np.array([0.0, -3.0, 0.0]))
