import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lubdub.geometry.frames import Similarity
from lubdub.geometry.rigid import (
    OverlaySettings,
    best_rigid,
    best_similarity,
    feature_cloud,
    icp,
    ransac_start,
)
from tests.bodies import Shape
from tests.overlays import degrees_apart, motion, seen_from_front

angles = st.floats(-179, 179)
seeds = st.integers(0, 10_000)


def some_points(seed: int, count: int = 8) -> np.ndarray:
    return 100 * np.random.default_rng(seed).standard_normal((count, 3))


@given(seeds, angles)
def test_a_rigid_motion_is_found_again(seed: int, degrees: float) -> None:
    points, moved = some_points(seed), motion(degrees, (0.3, 1, -2), (50, -400, 3))
    found = best_rigid(points, moved.apply(points))
    assert np.allclose(found.rotation, moved.rotation, atol=1e-9)
    assert np.allclose(found.translation, moved.translation, atol=1e-6)
    assert found.scale == 1


@given(seeds, angles, st.floats(0.2, 5))
def test_a_similarity_is_found_again(seed: int, degrees: float, scale: float) -> None:
    turn = motion(degrees, (0.3, 1, -2), (50, -400, 3))
    moved = Similarity(scale, turn.rotation, turn.translation)
    found = best_similarity(some_points(seed), moved.apply(some_points(seed)))
    assert found.scale == pytest.approx(scale)
    assert np.allclose(found.matrix(), moved.matrix(), atol=1e-6)


@given(seeds)
def test_mirrored_points_never_give_a_mirror(seed: int) -> None:
    points = some_points(seed)
    for best in (best_rigid, best_similarity):
        assert np.linalg.det(best(points, points * [-1, 1, 1]).rotation) == pytest.approx(1)


@given(seeds, seeds)
def test_no_other_motion_comes_nearer(seed: int, other: int) -> None:
    source, target = some_points(seed), some_points(seed + 1)
    best = best_similarity(source, target)
    nudge = np.random.default_rng(other)
    turn = motion(float(nudge.uniform(-5, 5)), (1, 1, 1), tuple(nudge.uniform(-3, 3, 3)))
    tried = Similarity(best.scale * nudge.uniform(0.9, 1.1), turn.rotation @ best.rotation, best.translation)
    assert ((best.apply(source) - target) ** 2).sum() <= ((tried.apply(source) - target) ** 2).sum() + 1e-6


def test_a_pair_of_weight_zero_is_not_looked_at() -> None:
    source = some_points(3)
    target = motion(40, (0, 1, 0), (1, 2, 3)).apply(source)
    target[5] += 900
    weights = np.ones(8)
    weights[5] = 0
    found = best_rigid(source, target, weights)
    assert np.allclose(found.apply(source)[:5], target[:5])


def test_points_on_a_line_leave_the_turn_open() -> None:
    line = np.outer(np.arange(5.0), [1, 2, 3])
    with pytest.raises(ValueError, match="line"):
        best_rigid(line, line)


def test_two_pairs_are_too_few() -> None:
    with pytest.raises(ValueError, match="three pairs"):
        best_rigid(np.eye(3)[:2], np.eye(3)[:2])


@settings(max_examples=8, deadline=None)
@given(st.floats(-175, 175), st.sampled_from([1.0, 0.5]))
def test_a_turned_body_is_laid_back_by_its_shape_alone(degrees: float, size: float) -> None:
    body = seen_from_front(Shape(size=size, breast=0.4, belly=0.5), 90, 80)
    moved = motion(degrees, (0.2, 0.4, 1), (200, -100, 50))
    overlay, spacing = OverlaySettings(), 20 * size
    source = feature_cloud(body.vertices, body.normals, spacing, overlay)
    target = feature_cloud(moved.apply(body.vertices), moved.turn(body.normals), spacing, overlay)
    found = icp(source, target, ransac_start(source, target, overlay), overlay)
    assert degrees_apart(found, moved) < 2
    assert np.linalg.norm(found.apply(body.vertices) - moved.apply(body.vertices), axis=1).max() < 10 * size


def test_the_same_bodies_give_the_same_start_every_time() -> None:
    body = seen_from_front(Shape(), 90, 80)
    overlay = OverlaySettings()
    clouds = [feature_cloud(body.vertices + shift, body.normals, 20, overlay) for shift in (0.0, 40.0)]
    first, second = (ransac_start(*clouds, overlay) for _ in range(2))
    assert np.array_equal(first.matrix(), second.matrix())


def test_nothing_is_written_where_results_are_expected(capfd: pytest.CaptureFixture[str]) -> None:
    body = seen_from_front(Shape(), 40, 40)
    child = seen_from_front(Shape(size=0.4), 40, 40)
    overlay = OverlaySettings()
    ransac_start(
        feature_cloud(body.vertices, body.normals, 40, overlay),
        feature_cloud(child.vertices, child.normals, 40, overlay),
        overlay,
    )
    assert capfd.readouterr().out == ""
