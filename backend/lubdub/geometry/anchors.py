"""Places fixed to a mesh: they follow the triangle they lie on wherever it goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.neighbours import closest_on_triangles
from lubdub.geometry.surface import Surface, carry


@dataclass(frozen=True)
class Anchors:
    """k places on a mesh. corners: (k, 3) int64 vertex indices; weights: (k, 3) barycentric."""

    corners: np.ndarray
    weights: np.ndarray

    def on(self, vertices: np.ndarray) -> np.ndarray:
        """(k, 3) the places, the mesh's vertices now being at vertices (n, 3)."""
        return carry(self.weights, self.corners, vertices)


def anchored(surface: Surface, points: np.ndarray) -> Anchors:
    """Fix points (k, 3) to the nearest places on a triangulated surface."""
    corners = surface.vertices[surface.triangles]
    first = corners[:, 0]
    reach = np.linalg.norm(corners[:, 1:] - first[:, None], axis=2).max(axis=1)
    indices, weights = np.zeros((len(points), 3), np.int64), np.zeros((len(points), 3))
    for row, point in enumerate(points):
        # No place on a triangle is nearer than its first corner by more than its longer side.
        away = np.linalg.norm(first - point, axis=1)
        near = np.flatnonzero(away - reach <= away.min())
        places = closest_on_triangles(point, corners[near])
        nearest = int(np.linalg.norm(places - point, axis=1).argmin())
        indices[row] = surface.triangles[near[nearest]]
        weights[row] = barycentric(places[nearest], corners[near[nearest]])
    return Anchors(indices, weights)


def barycentric(place: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(3,) weights of a place (3,) in the plane of a triangle with corners (3, 3); they sum to 1."""
    sides = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1)
    second, third = np.linalg.lstsq(sides, place - corners[0], rcond=None)[0]
    return np.array([1 - second - third, second, third])
