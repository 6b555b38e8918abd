"""One linear step of the paper's non-rigid ICP: eqs. 2 to 5 for fixed matches.

The unknown X holds one affine map for each of n source vertices, 4n rows of 3. With v = (x, y, z, 1) the
source vertices in homogeneous form, the three terms are rows of one least-squares problem:

    alpha (M kron G) X = 0          the stiffness of eq. 4, M the source's node-arc incidence matrix
    w_i v_i^T X_i      = w_i u_i^T  the distance of eq. 3, w_i being 0 or 1
    beta p_k^T X_i(k)  = beta l_k^T the landmarks of eq. 5

so that the energy has alpha^2 and beta^2 (see `schedule`). p_k is the landmark itself, carried by the map of
the vertex next to it, so that it needs no vertex of its own. The normal matrix has the same pattern in every
step: a block of 4 by 4 for each vertex, and a diagonal block for each edge.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix, diags, identity, kron
from scipy.spatial import cKDTree

from lubdub.fitting.matches import Matches
from lubdub.geometry.sparse import NormalSolver, SolverName
from lubdub.geometry.surface import edges_of


class AffineStep:
    """Solves for the affine maps of a source mesh, again and again, for other matches and weights.

    vertices: (n, 3) and triangles: (m, 3) of the undeformed source. landmarks: (k, 3) places on it.
    """

    def __init__(
        self,
        vertices: np.ndarray,
        triangles: np.ndarray,
        landmarks: np.ndarray,
        gamma: float = 1.0,
        solver: SolverName | None = None,
    ) -> None:
        count = len(vertices)
        self._source = np.column_stack([vertices, np.ones(count)])
        self._marks = np.column_stack([landmarks, np.ones(len(landmarks))])
        self._mark_vertex = cKDTree(vertices).query(landmarks)[1] if len(landmarks) else np.zeros(0, np.int64)
        stiffness = _stiffness(edges_of(triangles), count, gamma)
        self._pattern, self._stiffness, self._blocks = _pattern(stiffness, count)
        self._outer = self._source[:, :, None] * self._source[:, None, :]
        self._solver = NormalSolver(self._pattern, solver, group=4)

    def solve(self, matches: Matches, landmark_targets: np.ndarray, alpha: float, beta: float) -> np.ndarray:
        """(n, 4, 3) the maps X that minimise eq. 2. landmark_targets: (k, 3).

        Raises `geometry.sparse.NotSolvable` when matches and landmarks leave the maps open.
        """
        weight = matches.trusted.astype(np.float64)
        blocks = weight[:, None, None] * self._outer
        marks = beta * beta * self._marks
        np.add.at(blocks, self._mark_vertex, marks[:, :, None] * self._marks[:, None, :])
        right = weight[:, None, None] * self._source[:, :, None] * matches.points[:, None, :]
        np.add.at(right, self._mark_vertex, marks[:, :, None] * landmark_targets[:, None, :])

        values = alpha * alpha * self._stiffness
        values[self._blocks] += blocks
        matrix = csc_matrix((values, self._pattern.indices, self._pattern.indptr), shape=self._pattern.shape)
        self._solver.factorise(matrix)
        return self._solver.solve(right.reshape(-1, 3)).reshape(-1, 4, 3)

    def deformed(self, maps: np.ndarray) -> np.ndarray:
        """(n, 3) the source's vertices, each moved by its own map (n, 4, 3)."""
        return np.asarray(np.einsum("nk,nkd->nd", self._source, maps))


def _stiffness(edges: np.ndarray, count: int, gamma: float) -> csc_matrix:
    """(M kron G)^T (M kron G): the graph's Laplacian, once for each of the four columns of a map."""
    rows = np.repeat(np.arange(len(edges)), 2)
    signs = np.tile([-1.0, 1.0], len(edges))
    incidence = csc_matrix((signs, (rows, edges.ravel())), shape=(len(edges), count))
    return csc_matrix(kron(incidence.T @ incidence, diags([1.0, 1.0, 1.0, gamma**2])))


def _pattern(stiffness: csc_matrix, count: int) -> tuple[csc_matrix, np.ndarray, np.ndarray]:
    """The common pattern of all steps; the stiffness as values in it; and (count, 4, 4) places of the blocks."""
    blocks = csc_matrix(kron(identity(count), np.ones((4, 4))))
    pattern = csc_matrix(abs(stiffness) + blocks)
    pattern.sort_indices()
    # In each column the pattern's rows ascend, so a (column, row) pair is found by one sorted search.
    column = np.repeat(np.arange(4 * count), np.diff(pattern.indptr))
    keys = column.astype(np.int64) * (4 * count) + pattern.indices
    stiff = stiffness.tocoo()
    values = np.zeros(len(keys))
    values[np.searchsorted(keys, stiff.col.astype(np.int64) * (4 * count) + stiff.row)] = stiff.data
    first = 4 * np.arange(count, dtype=np.int64)[:, None, None]
    inside = np.arange(4, dtype=np.int64)
    wanted = (first + inside[None, None, :]) * (4 * count) + (first + inside[None, :, None])
    return pattern, values, np.searchsorted(keys, wanted)
