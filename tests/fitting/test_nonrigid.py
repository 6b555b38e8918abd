from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lubdub.fitting.matches import Target
from lubdub.fitting.nonrigid import BendStep, MarkPairs, NothingMatches, WorkingScale, bend
from lubdub.fitting.schedule import PAPER, PaperSettings
from lubdub.geometry.resample import front_shell
from lubdub.geometry.sparse import SolverName
from lubdub.geometry.surface import Surface
from tests.bodies import Shape, torso_surface
from tests.overlays import motion

NO_MARKS = MarkPairs(np.zeros((0, 3)), np.zeros((0, 3)))
PATIENT = replace(PAPER, acceptable_change_mm=0.3, most_repeats=20)


def bumpy(columns: int, rows: int) -> Surface:
    """A torso with bumps everywhere, so that every place of its skin can be told from its neighbours."""
    smooth = torso_surface(Shape(breast=0.4, belly=0.4), columns, rows)
    x, y, _ = smooth.vertices.T
    height = 14 * np.sin(x / 13) * np.sin(y / 14) + 7 * np.sin(x / 31 + y / 23)
    return front_shell(Surface(smooth.vertices + height[:, None] * smooth.normals, smooth.triangles))


def warped(points: np.ndarray) -> np.ndarray:
    """Another build, smoothly: wider, shorter, bent sideways, the belly out and the chest in; 8.7 mm on average."""
    x, y, z = points.T
    belly = 9 * np.exp(-(x**2 + (y + 350) ** 2) / (2 * 90**2)) - 5 * np.exp(-(x**2 + (y + 100) ** 2) / (2 * 80**2))
    return np.stack([1.04 * x + 0.025 * y, 0.975 * y - 3, 1.05 * z + belly], axis=1)


def target_of(surface: Surface) -> Target:
    return Target(surface.vertices, surface.normals, np.zeros(len(surface.vertices), bool))


def last(
    source: Surface,
    target: Target,
    marks: MarkPairs = NO_MARKS,
    settings: PaperSettings = PAPER,
    solver: SolverName | None = None,
) -> BendStep:
    return list(bend(source, target, marks, settings, solver))[-1]


@pytest.fixture(scope="module")
def source() -> Surface:
    return bumpy(66, 58)


@pytest.fixture(scope="module")
def dense() -> Surface:
    return bumpy(200, 180)


def test_a_body_that_is_already_there_stays_there(source: Surface) -> None:
    step = last(source, target_of(source))
    assert np.linalg.norm(step.vertices - source.vertices, axis=1).max() < 0.01
    assert step.matched_share == 1


def test_a_smooth_change_of_shape_is_recovered() -> None:
    source, dense = bumpy(80, 70), bumpy(240, 210)
    target = target_of(Surface(warped(dense.vertices), dense.triangles))
    places = np.array([(0, 0), (0, -150), (0, -367), (95, -158), (-95, -158)])
    marked = [int(np.linalg.norm(source.vertices[:, :2] - place, axis=1).argmin()) for place in places]
    marks = MarkPairs(source.vertices[marked], warped(source.vertices[marked]))
    before = np.linalg.norm(source.vertices - warped(source.vertices), axis=1)
    after = np.linalg.norm(last(source, target, marks, PATIENT).vertices - warped(source.vertices), axis=1)
    assert before.mean() > 8
    assert after.mean() < 2


def test_both_solvers_bend_alike(source: Surface, dense: Surface) -> None:
    target = target_of(Surface(warped(dense.vertices), dense.triangles))
    ends = [last(source, target, solver=name).vertices for name in ("cholmod", "superlu")]
    assert np.allclose(ends[0], ends[1], atol=1e-6)


def test_moving_everything_moves_the_answer_and_changes_nothing_else(source: Surface, dense: Surface) -> None:
    goal = Surface(warped(dense.vertices), dense.triangles)
    moved = motion(130, (1, -1, 0.4), (700, 20, -4000))
    there = Surface(moved.apply(source.vertices), source.triangles)
    answer = last(there, target_of(Surface(moved.apply(goal.vertices), goal.triangles))).vertices
    apart = np.linalg.norm(answer - moved.apply(last(source, target_of(goal)).vertices), axis=1)
    # Not exactly nothing: the working scale is a box's diagonal, and the box does not turn along.
    assert apart.mean() < 0.3


def test_the_unit_of_length_changes_nothing(source: Surface, dense: Surface) -> None:
    goal = Surface(warped(dense.vertices), dense.triangles)
    half = replace(PAPER, acceptable_change_mm=PAPER.acceptable_change_mm / 2)
    small = last(
        Surface(source.vertices / 2, source.triangles),
        target_of(Surface(goal.vertices / 2, goal.triangles)),
        settings=half,
    )
    assert np.allclose(2 * small.vertices, last(source, target_of(goal)).vertices, atol=1e-6)


def test_the_order_of_points_changes_nothing(source: Surface, dense: Surface) -> None:
    target = target_of(Surface(warped(dense.vertices), dense.triangles))
    order = np.random.default_rng(5).permutation(len(source.vertices))
    place = np.argsort(order)
    shuffled = Surface(source.vertices[order], place[source.triangles])
    mixed = np.random.default_rng(6).permutation(len(target.points))
    turned = Target(target.points[mixed], target.normals[mixed], target.is_border[mixed])
    assert np.allclose(last(shuffled, turned).vertices, last(source, target).vertices[order], atol=1e-6)


def test_landmarks_pull_their_part_of_the_body_along(source: Surface) -> None:
    middle = source.vertices[np.linalg.norm(source.vertices[:, :2] - [0, -200], axis=1).argmin()]
    marks = MarkPairs(middle[None], middle[None] + [0, 40, 0])
    one_step = replace(PAPER, stiffness=(2,), landmark_weights=(500,), most_repeats=1)
    pulled = last(source, target_of(source), marks, one_step).vertices - source.vertices
    near = np.linalg.norm(source.vertices - middle, axis=1).argmin()
    assert pulled[near, 1] > 20
    assert np.median(np.abs(pulled[:, 1])) < pulled[near, 1] / 2


def test_the_schedule_is_walked_from_stiff_to_soft_and_each_step_is_told(source: Surface, dense: Surface) -> None:
    steps = list(bend(source, target_of(Surface(warped(dense.vertices), dense.triangles)), NO_MARKS, PAPER))
    assert list(dict.fromkeys(step.alpha for step in steps)) == [50, 20, 5, 2, 0.8, 0.5, 0.35, 0.3, 0.2]
    assert steps[-1].change_mm < 3
    assert set(steps[0].numbers()) == {"alpha", "iteration", "change_mm", "matched_share"}
    for step, following in pairwise(steps):
        assert (step.change_mm < 3) == (following.iteration == 0)


def test_landmark_weights_follow_the_paper_and_then_stay_at_the_last_word() -> None:
    assert [beta for _, beta in PAPER.steps()] == [5, 2, 0.5, 0, 0, 0, 0, 0, 0]
    held = replace(PAPER, last_landmark_weight=0.5)
    assert [beta for _, beta in held.steps()][2:] == [0.5] * 7


def test_a_body_far_from_the_scan_is_not_bent_at_all(source: Surface) -> None:
    away = Target(source.vertices + [5000, 0, 0], source.normals, np.zeros(len(source.vertices), bool))
    with pytest.raises(NothingMatches):
        last(source, away)


def test_skin_beyond_the_scans_rim_is_not_dragged_to_the_rim(source: Surface) -> None:
    half = source.kept(source.vertices[:, 1] > -200)
    on_rim = half.vertices[:, 1] < -200 + 25
    target = Target(half.vertices, half.normals, on_rim)
    beyond = source.vertices[:, 1] < -300
    kept = last(source, target).vertices - source.vertices
    dragged = last(source, target, settings=replace(PAPER, skip_border=False, farthest_match=1.0)).vertices
    assert np.abs(kept[beyond]).max() < 5
    assert np.abs(dragged - source.vertices)[beyond].max() > 20


def test_the_working_scale_has_a_diagonal_of_one_about_the_sources_middle() -> None:
    points = np.random.default_rng(1).uniform(-300, 900, (50, 3))
    inner = WorkingScale.of(points).enter(points)
    assert np.linalg.norm(np.ptp(inner, axis=0)) == pytest.approx(1)
    assert np.allclose(inner.mean(axis=0), 0)
    assert np.allclose(WorkingScale.of(points).leave(inner), points)
