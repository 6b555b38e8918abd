"""A short non-rigid refinement after the shape fit: the body's own skin, laid exactly on the scanned one.

Displacements d of the n vertices minimise
    sum w_i ((x_i + d_i - u_i) . n_i)² + p² |x_i + d_i - u_i|²  +  a |L d|²  +  b² sum |x_l + d_l - l|²
with L the umbrella Laplacian of the mesh, so a is a bending stiffness. A displacement field cannot turn or
scale, which the shape fit has done already; one symbolic analysis serves all steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import bsr_matrix, csc_matrix, csr_matrix, identity, kron

from lubdub.fitting.shape import Pull, Target, carried
from lubdub.geometry.sparse import NormalSolver
from lubdub.geometry.surface import Surface, edges_of
from lubdub.results import LANDMARK_NAMES, Fit, LandmarkName, ShapeBasis


@dataclass(frozen=True)
class RefineSettings:
    """Measured beside the shape fit alone: the same areas within 0.2 mm, and a truer overlay."""

    stiffness: tuple[float, ...] = (100.0, 30.0, 10.0)
    steps_each: int = 1
    reach_mm: float = 8.0
    """Geman-McClure scale of the match weights."""
    point_to_point: float = 0.1
    match_angle_deg: float = 50.0
    landmark_weight: float = 10.0
    """Divided by a pull's sigma in mm."""


def refine(
    fit: Fit,
    target: Target,
    pulls: Mapping[LandmarkName, Pull],
    basis: ShapeBasis,
    settings: RefineSettings | None = None,
) -> Fit:
    """The fitted body after the refinement; its landmarks and areas move with the mesh."""
    settings = settings or RefineSettings()
    start = fit.surface.vertices
    bending = _bending(fit.surface)
    solver: NormalSolver | None = None
    vertices = start
    for stiffness in np.repeat(settings.stiffness, settings.steps_each):
        blocks, right = _skin(vertices, start, fit.surface.triangles, target, basis, settings)
        pulled, pulled_right = _landmarks(start, pulls, basis, settings)
        matrix = csc_matrix(_block_diagonal(blocks) + stiffness * bending + pulled)
        solver = solver or NormalSolver(matrix, group=3)
        solver.factorise(matrix)
        vertices = start + solver.solve((right + pulled_right).ravel()).reshape(-1, 3)
    body = carried(Surface(vertices, fit.surface.triangles), basis)
    return replace(fit, surface=body.surface, landmarks=body.landmarks, areas=body.areas)


def _bending(surface: Surface) -> csc_matrix:
    """(3n, 3n) squared umbrella Laplacian, the same for each coordinate."""
    edges, count = edges_of(surface.triangles), len(surface.vertices)
    ones = np.ones(len(edges))
    adjacency = csr_matrix((ones, (edges[:, 0], edges[:, 1])), (count, count))
    adjacency = adjacency + adjacency.T
    degree = np.maximum(np.asarray(adjacency.sum(axis=1)).ravel(), 1.0)
    laplacian = identity(count) - csr_matrix((1 / degree, (np.arange(count), np.arange(count)))) @ adjacency
    return kron(laplacian.T @ laplacian, identity(3)).tocsc()


def _skin(
    vertices: np.ndarray,
    start: np.ndarray,
    triangles: np.ndarray,
    target: Target,
    basis: ShapeBasis,
    settings: RefineSettings,
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 3) blocks and (n, 3) right sides of the matched skin."""
    normals = Surface(vertices, triangles).normals
    distance, nearest = target.tree.query(vertices, distance_upper_bound=3 * settings.reach_mm)
    found = np.isfinite(distance)
    nearest = np.where(found, nearest, 0)
    points, facing = target.points[nearest], target.normals[nearest]
    good = found & ~target.is_border[nearest]
    good &= (normals * facing).sum(1) > np.cos(np.deg2rad(settings.match_angle_deg))
    residual = ((vertices - points) * facing).sum(1)
    scale = settings.reach_mm**2
    weight = np.where(good, basis.data_weight * (scale / (scale + residual**2)) ** 2, 0.0)
    plane = np.einsum("n,na,nb->nab", weight, facing, facing)
    # The last term keeps every block full, so that all matrices share one pattern; it is positive semidefinite.
    whisper = 1e-6 * np.eye(3) + 1e-9 * np.ones((3, 3))
    blocks = plane + (weight * settings.point_to_point**2)[:, None, None] * np.eye(3) + whisper
    return blocks, np.einsum("nab,nb->na", blocks, points - start) * good[:, None]


def _block_diagonal(blocks: np.ndarray) -> csc_matrix:
    count = len(blocks)
    return bsr_matrix((blocks, np.arange(count), np.arange(count + 1)), shape=(3 * count, 3 * count)).tocsc()


def _landmarks(
    start: np.ndarray, pulls: Mapping[LandmarkName, Pull], basis: ShapeBasis, settings: RefineSettings
) -> tuple[csc_matrix, np.ndarray]:
    """(3n, 3n) matrix and (n, 3) right side of the landmark pulls."""
    count = len(start)
    rows, right = csr_matrix((count, count)), np.zeros((count, 3))
    for name, pull in pulls.items():
        index = LANDMARK_NAMES.index(name)
        corners, weights = basis.landmark_corners[index], basis.landmark_weights[index]
        strength = (settings.landmark_weight / pull.sigma_mm) ** 2
        row = csr_matrix((weights, (np.zeros(3, int), corners)), (1, count))
        rows = rows + strength * (row.T @ row)
        np.add.at(right, corners, strength * weights[:, None] * (pull.position - weights @ start[corners]))
    return kron(rows, identity(3)).tocsc(), right
