import numpy as np
import pytest
from scipy.sparse import csr_matrix, kron

from lubdub.fitting.matches import Matches
from lubdub.fitting.solve import AffineStep
from lubdub.geometry.sparse import NotSolvable
from lubdub.geometry.surface import edges_of
from tests.bodies import Shape, torso_surface

GAMMA, ALPHA, BETA = 2.0, 3.0, 0.7


@pytest.fixture(scope="module")
def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray, Matches, np.ndarray]:
    body = torso_surface(Shape(), 10, 9)
    vertices = body.vertices / 700
    rng = np.random.default_rng(8)
    goal = vertices + 0.05 * rng.standard_normal(vertices.shape)
    trusted = rng.random(len(vertices)) < 0.8
    marks = vertices[[3, 40]] + 0.002
    return vertices, body.triangles, marks, Matches(goal, trusted, np.ones(len(vertices), bool)), marks + 0.03


def test_a_step_is_the_least_squares_answer_of_ambergs_stacked_rows(
    problem: tuple[np.ndarray, np.ndarray, np.ndarray, Matches, np.ndarray],
) -> None:
    vertices, triangles, marks, matches, mark_targets = problem
    count, edges = len(vertices), edges_of(triangles)
    incidence = np.zeros((len(edges), count))
    incidence[np.arange(len(edges)), edges[:, 0]] = -1
    incidence[np.arange(len(edges)), edges[:, 1]] = 1
    stiff = ALPHA * kron(csr_matrix(incidence), np.diag([1, 1, 1, GAMMA])).toarray()
    data = np.zeros((count, 4 * count))
    for i in range(count):
        data[i, 4 * i : 4 * i + 4] = matches.trusted[i] * np.append(vertices[i], 1)
    nearest = [int(np.linalg.norm(vertices - mark, axis=1).argmin()) for mark in marks]
    pull = np.zeros((2, 4 * count))
    for row, (vertex, mark) in enumerate(zip(nearest, marks, strict=True)):
        pull[row, 4 * vertex : 4 * vertex + 4] = BETA * np.append(mark, 1)
    left = np.vstack([stiff, data, pull])
    right = np.vstack([np.zeros((4 * len(edges), 3)), matches.trusted[:, None] * matches.points, BETA * mark_targets])
    expected = np.linalg.lstsq(left, right, rcond=None)[0].reshape(count, 4, 3)
    step = AffineStep(vertices, triangles, marks, GAMMA)
    assert np.allclose(step.solve(matches, mark_targets, ALPHA, BETA), expected, atol=1e-7)


def test_a_second_solve_with_other_numbers_is_not_coloured_by_the_first(
    problem: tuple[np.ndarray, np.ndarray, np.ndarray, Matches, np.ndarray],
) -> None:
    vertices, triangles, marks, matches, mark_targets = problem
    used = AffineStep(vertices, triangles, marks)
    used.solve(matches, mark_targets, 50, 5)
    again = used.solve(matches, mark_targets, ALPHA, BETA)
    fresh = AffineStep(vertices, triangles, marks).solve(matches, mark_targets, ALPHA, BETA)
    assert np.allclose(again, fresh, atol=1e-9)


def test_without_matches_and_landmarks_nothing_can_be_solved(
    problem: tuple[np.ndarray, np.ndarray, np.ndarray, Matches, np.ndarray],
) -> None:
    vertices, triangles, _, matches, _ = problem
    nothing = Matches(matches.points, np.zeros(len(vertices), bool), matches.covered)
    step = AffineStep(vertices, triangles, np.zeros((0, 3)))
    with pytest.raises(NotSolvable):
        step.solve(nothing, np.zeros((0, 3)), ALPHA, BETA)
