"""Nearest points: on points, and on triangles."""

from __future__ import annotations

import numpy as np

from lubdub.geometry.surface import Surface


def closest_on_triangles(point: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """For one point (3,), the closest point on each of m triangles. corners: (m, 3, 3). Returns (m, 3).

    The seven Voronoi regions of a triangle, as in Ericson, Real-Time Collision Detection (2005), 5.1.5.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, ac = b - a, c - a
    normal = np.cross(ab, ac)
    area2 = (normal * normal).sum(1)
    flat = area2 < 1e-24
    area2 = np.where(flat, 1.0, area2)
    ap = point - a
    v = (np.cross(ap, ac) * normal).sum(1) / area2
    w = (np.cross(ab, ap) * normal).sum(1) / area2
    inside = (v >= 0) & (w >= 0) & (v + w <= 1) & ~flat
    best = a + v[:, None] * ab + w[:, None] * ac
    on_edges = np.stack([_closest_on_segment(point, p, q) for p, q in ((a, b), (b, c), (c, a))])
    nearest_edge = np.linalg.norm(on_edges - point, axis=2).argmin(0)
    return np.where(inside[:, None], best, on_edges[nearest_edge, np.arange(len(a))])


def _closest_on_segment(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    t = ((point - start) * along).sum(1) / np.maximum((along * along).sum(1), 1e-300)
    return np.asarray(start + np.clip(t, 0, 1)[:, None] * along)


class SurfaceFinder:
    """Answers, for single points, where the nearest place on a surface is; cheap even for a million triangles."""

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._starts = surface.vertices if surface.is_cloud else surface.vertices[surface.triangles[:, 0]]
        self._reaches = np.zeros(len(self._starts))
        for corner in () if surface.is_cloud else (1, 2):
            edge = surface.vertices[surface.triangles[:, corner]] - self._starts
            self._reaches = np.maximum(self._reaches, np.sqrt(np.einsum("md,md->m", edge, edge)))

    @property
    def is_cloud(self) -> bool:
        """True when the surface has points only."""
        return self._surface.is_cloud

    def nearest(self, point: np.ndarray, first_reach: float) -> np.ndarray:
        """(3,) the nearest place to point (3,): on a triangle of a mesh, a point of a cloud.

        first_reach: where to look first, of the order of the expected distance; it is doubled until skin is
        found, so the answer is exact whatever it was.
        """
        offset = self._starts - point
        distance = np.sqrt(np.einsum("md,md->m", offset, offset))
        if self._surface.is_cloud:
            return self._surface.vertices[distance.argmin()]
        at_least = distance - self._reaches
        reach = first_reach
        while True:
            near = np.flatnonzero(at_least <= reach)
            if len(near):
                places = closest_on_triangles(point, self._surface.vertices[self._surface.triangles[near]])
                distances = np.linalg.norm(places - point, axis=1)
                if distances.min() <= reach:
                    return places[distances.argmin()]
            reach = 2 * max(reach, float(at_least.min()))
