import itertools

import numpy as np
import pytest
from scipy.sparse import csc_matrix, identity, random_array

from lubdub.geometry import sparse
from lubdub.geometry.sparse import NormalSolver, NotSolvable, solver_name


def some_matrix(seed: int, count: int = 80) -> csc_matrix:
    half = csc_matrix(random_array((count, count), density=0.05, rng=np.random.default_rng(seed)))
    return csc_matrix(half.T @ half + identity(count))


@pytest.mark.parametrize("solver", ["cholmod", "superlu"])
def test_the_answer_solves_the_system(solver: sparse.SolverName) -> None:
    matrix = some_matrix(1)
    right = np.random.default_rng(2).standard_normal((80, 3))
    normal = NormalSolver(matrix, solver)
    normal.factorise(matrix)
    assert np.allclose(matrix @ normal.solve(right), right, atol=1e-10)
    assert np.allclose(matrix @ normal.solve(right[:, 0]), right[:, 0], atol=1e-10)


def test_both_solvers_give_the_same_answers_for_many_matrices_of_one_pattern() -> None:
    matrix, right = some_matrix(3), np.arange(80.0)
    solvers = [NormalSolver(matrix, name) for name in ("cholmod", "superlu")]
    for factor in (1.0, 7.0, 0.01):
        changed = matrix + csc_matrix(factor * identity(80))
        answers = []
        for solver in solvers:
            solver.factorise(changed)
            answers.append(solver.solve(right))
        assert np.allclose(answers[0], answers[1], rtol=1e-10)
        assert np.allclose(changed @ answers[0], right)


@pytest.mark.parametrize("solver", ["cholmod", "superlu"])
def test_a_system_that_leaves_something_open_is_refused(solver: sparse.SolverName) -> None:
    laplacian = csc_matrix(np.array([[1.0, -1.0], [-1.0, 1.0]]) * 3)
    normal = NormalSolver(laplacian, solver)
    with pytest.raises(NotSolvable):
        normal.factorise(laplacian)


@pytest.mark.parametrize("solver", ["cholmod", "superlu"])
@pytest.mark.parametrize("group", [2, 4])
def test_unknowns_ordered_by_groups_have_the_same_answer(solver: sparse.SolverName, group: int) -> None:
    matrix, right = some_matrix(6), np.random.default_rng(7).standard_normal((80, 3))
    normal = NormalSolver(matrix, solver, group)
    normal.factorise(matrix)
    assert np.allclose(matrix @ normal.solve(right), right, atol=1e-10)


def test_a_matrix_whose_entries_are_stored_in_another_order_is_the_same_matrix() -> None:
    matrix = some_matrix(8)
    shuffled = matrix.copy()
    shuffled.indices, shuffled.data = _each_column_reversed(shuffled, shuffled.indices, shuffled.data)
    shuffled.has_sorted_indices = False
    normal = NormalSolver(matrix)
    normal.factorise(shuffled)
    assert np.allclose(matrix @ normal.solve(np.ones(80)), 1)


def _each_column_reversed(matrix: csc_matrix, *arrays: np.ndarray) -> list[np.ndarray]:
    spans = list(itertools.pairwise(matrix.indptr))
    return [np.concatenate([array[first:end][::-1] for first, end in spans]) for array in arrays]


def test_a_matrix_of_another_pattern_is_refused() -> None:
    normal = NormalSolver(some_matrix(9), "cholmod")
    with pytest.raises(ValueError, match="another pattern"):
        normal.factorise(some_matrix(10))


def test_nothing_is_solved_before_there_is_a_matrix() -> None:
    with pytest.raises(ValueError, match="no matrix"):
        NormalSolver(some_matrix(9)).solve(np.ones(80))


def test_without_cholmod_the_work_goes_on_with_superlu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sparse, "_cholmod", lambda: None)
    assert solver_name() == "superlu"
    matrix = some_matrix(5)
    normal = NormalSolver(matrix)
    assert normal.name == "superlu"
    normal.factorise(matrix)
    assert np.allclose(matrix @ normal.solve(np.ones(80)), 1)
    with pytest.raises(ValueError, match="not installed"):
        NormalSolver(matrix, "cholmod")
