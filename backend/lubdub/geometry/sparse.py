"""Solving with a sparse symmetric positive definite matrix whose pattern stays the same while its numbers change."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Literal

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

SolverName = Literal["cholmod", "superlu"]


class NotSolvable(ArithmeticError):
    """The matrix is not positive definite: too little is known to fix every unknown."""


@cache
def _cholmod() -> ModuleType | None:
    try:
        from sksparse import cholmod
    except ImportError:  # the C library could not be built on this machine
        return None
    return cholmod


def solver_name() -> SolverName:
    """The solver that is used here unless told otherwise: CHOLMOD where it is installed, else SciPy's SuperLU."""
    return "superlu" if _cholmod() is None else "cholmod"


class NormalSolver:
    """Analyses a pattern once and then solves for many matrices of that pattern.

    pattern: (n, n) symmetric, sparse columns; only where its entries stand matters, explicit zeros count.
    group: so many unknowns in a row belong together, like the coordinates of one vertex. Ordering the n / group
    nodes instead of the unknowns takes a sixth of the time and leaves a factor that is a third quicker to compute.
    solver: None for `solver_name()`. Both solvers give the same answers; SuperLU takes about four times as long.
    Raises ValueError when CHOLMOD is asked for and not installed.
    """

    def __init__(self, pattern: csc_matrix, solver: SolverName | None = None, group: int = 1) -> None:
        self.name: SolverName = solver or solver_name()
        self._solve: Callable[[np.ndarray], np.ndarray] | None = None
        if self.name == "cholmod":
            cholmod = _cholmod()
            if cholmod is None:
                raise ValueError("CHOLMOD is not installed here")
            self._not_definite: tuple[type[Exception], ...] = (cholmod.CholmodNotPositiveDefiniteError,)
            self._pattern = pattern.sorted_indices()
            nodes = cholmod.analyze(_nodes(pattern, group), mode="supernodal", ordering_method="nesdis").P()
            self._order = (group * nodes[:, None].astype(np.int64) + np.arange(group)).ravel()
            self._ordered, self._places = _reordered(self._pattern, self._order)
            self._factor = cholmod.analyze(self._ordered, mode="supernodal", ordering_method="natural")
        else:
            self._not_definite = (RuntimeError,)  # what splu raises for an exactly singular matrix

    def factorise(self, matrix: csc_matrix) -> None:
        """Take new numbers. Raises NotSolvable when they are not positive definite, ValueError for another pattern."""
        try:
            if self.name == "cholmod":
                self._ordered.data = self._numbers(matrix)[self._places]
                self._factor.cholesky_inplace(self._ordered)
                self._solve = self._solve_in_order
            else:
                options = {"SymmetricMode": True}
                factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
                self._solve = factor.solve
        except self._not_definite as error:
            raise NotSolvable("too little is known to fix every unknown") from error

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x with matrix @ x = right. right: (n,) or (n, k). Call `factorise` first, else ValueError."""
        if self._solve is None:
            raise ValueError("there is no matrix yet")
        return self._solve(right)

    def _numbers(self, matrix: csc_matrix) -> np.ndarray:
        """The matrix's numbers as they stand in the sorted pattern."""
        matrix = matrix if matrix.has_sorted_indices else matrix.sorted_indices()
        same = np.array_equal(matrix.indptr, self._pattern.indptr)
        if not same or not np.array_equal(matrix.indices, self._pattern.indices):
            raise ValueError("the matrix has another pattern than the one that was analysed")
        return np.asarray(matrix.data)

    def _solve_in_order(self, right: np.ndarray) -> np.ndarray:
        answer = np.empty(right.shape)
        answer[self._order] = self._factor(right[self._order])
        return answer


def _nodes(pattern: csc_matrix, group: int) -> csc_matrix:
    """(n / group, n / group) which nodes have unknowns that meet."""
    column = np.repeat(np.arange(pattern.shape[1]), np.diff(pattern.indptr)) // group
    count = pattern.shape[0] // group
    return csc_matrix((np.ones(pattern.nnz), (pattern.indices // group, column)), shape=(count, count))


def _reordered(pattern: csc_matrix, order: np.ndarray) -> tuple[csc_matrix, np.ndarray]:
    """The pattern with rows and columns in another order, and where in its numbers each number comes from."""
    numbered = csc_matrix((np.arange(1.0, pattern.nnz + 1), pattern.indices, pattern.indptr), shape=pattern.shape)
    ordered = csc_matrix(numbered[order][:, order])
    ordered.sort_indices()
    return ordered, ordered.data.astype(np.int64) - 1
