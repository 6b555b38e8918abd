"""Solving with a sparse symmetric positive definite matrix whose pattern stays the same while its numbers change."""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import Any, Literal

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
    solver: None for `solver_name()`. Both solvers give the same answers; SuperLU is about 1.6 times slower.
    Raises ValueError when CHOLMOD is asked for and not installed.
    """

    def __init__(self, pattern: csc_matrix, solver: SolverName | None = None) -> None:
        self.name: SolverName = solver or solver_name()
        self._factor: Any = None
        if self.name == "cholmod":
            cholmod = _cholmod()
            if cholmod is None:
                raise ValueError("CHOLMOD is not installed here")
            self._not_definite: tuple[type[Exception], ...] = (cholmod.CholmodNotPositiveDefiniteError,)
            self._factor = cholmod.analyze(pattern, mode="supernodal", ordering_method="nesdis")
        else:
            self._not_definite = (RuntimeError,)  # what splu raises for an exactly singular matrix

    def factorise(self, matrix: csc_matrix) -> None:
        """Take new numbers (same pattern). Raises NotSolvable when they are not positive definite."""
        try:
            if self.name == "cholmod":
                self._factor.cholesky_inplace(matrix)
            else:
                options = {"SymmetricMode": True}
                self._factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        except self._not_definite as error:
            raise NotSolvable("too little is known to fix every unknown") from error

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x with matrix @ x = right. right: (n,) or (n, k). Call `factorise` first."""
        return np.asarray(self._factor(right) if self.name == "cholmod" else self._factor.solve(right))
