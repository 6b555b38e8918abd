"""A short non-rigid refinement after the shape fit: the body's own skin, laid exactly on the scanned one.

Displacements d of the n vertices minimise
    sum w_i |x_i + d_i - t_i|²  +  a |L d|²  +  b² sum |x_l + d_l - l|²
with t_i the foot of vertex i on the tangent plane of the skin it is matched with, and L the umbrella Laplacian of the
mesh, so a is a bending stiffness. The foot leaves a vertex where it lies along the skin, as point-to-plane does, but
with it the three coordinates do not meet: one matrix of n unknowns serves all three. A displacement field cannot turn
or scale, which the shape fit has done already; one symbolic analysis serves all steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags_array, identity

from lubdub.fitting.shape import Pull, Target, carried
from lubdub.geometry.sparse import NormalSolver
from lubdub.geometry.surface import Surface, edges_of
from lubdub.results import LANDMARK_NAMES, Fit, LandmarkName, ShapeBasis


@dataclass(frozen=True)
class RefineSettings:
    """Measured on 80 simulated people beside the shape fit alone: the mesh's own areas within 0.1 mm, nearer skin.

    With point-to-plane itself, whose matrix has 3 n unknowns, it took four times as long, and its areas were 0.4 mm
    worse: where only the plane holds it, a click drags the skin around it along.
    """

    stiffness: tuple[float, ...] = (100.0, 30.0, 10.0)
    reach_mm: float = 8.0
    """Geman-McClure scale of the match weights."""
    match_angle_deg: float = 50.0
    landmark_weight: float = 10.0
    """Divided by a pull's sigma in mm."""
    whisper: float = 1e-6
    """Weight of staying put, so that every matrix has one solution."""


def refine(
    fit: Fit,
    target: Target,
    pulls: Mapping[LandmarkName, Pull],
    basis: ShapeBasis,
    settings: RefineSettings | None = None,
) -> Fit:
    """The fitted body after the refinement; its landmarks and areas move with the mesh."""
    settings = settings or RefineSettings()
    start, triangles = fit.surface.vertices, fit.surface.triangles
    bending = _bending(fit.surface)
    pulled, pulled_right = _landmarks(start, pulls, basis, settings)
    solver: NormalSolver | None = None
    vertices = start
    for stiffness in settings.stiffness:
        weights, feet = _skin(Surface(vertices, triangles), target, basis, settings)
        matrix = csc_matrix(stiffness * bending + pulled + diags_array(weights + settings.whisper))
        solver = solver or NormalSolver(matrix)
        solver.factorise(matrix)
        vertices = start + solver.solve(weights[:, None] * (feet - start) + pulled_right)
    body = carried(Surface(vertices, triangles), basis)
    return replace(fit, surface=body.surface, landmarks=body.landmarks, areas=body.areas)


def _bending(surface: Surface) -> csc_matrix:
    """(n, n) squared umbrella Laplacian."""
    edges, count = edges_of(surface.triangles), len(surface.vertices)
    ones = np.ones(len(edges))
    adjacency = csr_matrix((ones, (edges[:, 0], edges[:, 1])), (count, count))
    adjacency = adjacency + adjacency.T
    degree = np.maximum(np.asarray(adjacency.sum(axis=1)).ravel(), 1.0)
    laplacian = identity(count) - diags_array(1 / degree) @ adjacency
    return csc_matrix(laplacian.T @ laplacian)


def _skin(body: Surface, target: Target, basis: ShapeBasis, settings: RefineSettings) -> tuple[np.ndarray, np.ndarray]:
    """(n,) match weights, 0 without a match, and (n, 3) feet on the tangent planes of the matched skin."""
    distance, nearest = target.tree.query(body.vertices, distance_upper_bound=3 * settings.reach_mm)
    found = np.isfinite(distance)
    nearest = np.where(found, nearest, 0)
    facing = target.normals[nearest]
    good = found & ~target.is_border[nearest]
    good &= (body.normals * facing).sum(1) > np.cos(np.deg2rad(settings.match_angle_deg))
    residual = ((body.vertices - target.points[nearest]) * facing).sum(1)
    scale = settings.reach_mm**2
    weights = np.where(good, basis.data_weight * (scale / (scale + residual**2)) ** 2, 0.0)
    return weights, body.vertices - residual[:, None] * facing


def _landmarks(
    start: np.ndarray, pulls: Mapping[LandmarkName, Pull], basis: ShapeBasis, settings: RefineSettings
) -> tuple[csr_matrix, np.ndarray]:
    """(n, n) matrix and (n, 3) right side of the landmark pulls."""
    count = len(start)
    matrix, right = csr_matrix((count, count)), np.zeros((count, 3))
    for name, pull in pulls.items():
        index = LANDMARK_NAMES.index(name)
        corners, weights = basis.landmark_corners[index], basis.landmark_weights[index]
        strength = (settings.landmark_weight / pull.sigma_mm) ** 2
        row = csr_matrix((weights, (np.zeros(3, int), corners)), (1, count))
        matrix = matrix + strength * (row.T @ row)
        np.add.at(right, corners, strength * weights[:, None] * (pull.position - weights @ start[corners]))
    return matrix, right
