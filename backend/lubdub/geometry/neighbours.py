"""Nearest points: on points, and on triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.surface import Surface, triangle_normals, unit


def closest_on_triangles(point: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """For one point (3,), the closest point on each of m triangles. corners: (m, 3, 3). Returns (m, 3).

    The seven Voronoi regions of a triangle, as in Ericson, Real-Time Collision Detection (2005), 5.1.5.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, ac = b - a, c - a
    normal = np.cross(ab, ac)
    area2 = np.maximum((normal * normal).sum(1), 1e-300)
    ap = point - a
    v = (np.cross(ap, ac) * normal).sum(1) / area2
    w = (np.cross(ab, ap) * normal).sum(1) / area2
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    best = a + v[:, None] * ab + w[:, None] * ac
    on_edges = np.stack([_closest_on_segment(point, p, q) for p, q in ((a, b), (b, c), (c, a))])
    nearest_edge = np.linalg.norm(on_edges - point, axis=2).argmin(0)
    return np.where(inside[:, None], best, on_edges[nearest_edge, np.arange(len(a))])


def _closest_on_segment(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    t = ((point - start) * along).sum(1) / np.maximum((along * along).sum(1), 1e-300)
    return np.asarray(start + np.clip(t, 0, 1)[:, None] * along)


class SurfaceFinder:
    """Answers, for single points, where the nearest place on a surface is.

    On a mesh the answer lies on a triangle; on a cloud it is one of the points.
    """

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._tree = cKDTree(surface.vertices)
        corners = surface.triangles.ravel()
        self._order = np.argsort(corners, kind="stable")
        self._starts = np.searchsorted(corners[self._order], np.arange(len(surface.vertices) + 1))

    def nearest(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(3,) the nearest place to point (3,), and (3,) the triangle normal there (zero on a cloud).

        Looks at the triangles around the 32 nearest vertices: exact unless triangles are far larger than
        their spacing, and then still a place on the surface.
        """
        count = min(32, len(self._surface.vertices))
        near = np.atleast_1d(self._tree.query(point, k=count)[1])
        touching = np.unique(
            np.concatenate([self._order[self._starts[i] : self._starts[i + 1]] // 3 for i in near])
        ).astype(np.int64)
        if len(touching) == 0:
            return self._surface.vertices[near[0]], np.zeros(3)
        triangles = self._surface.triangles[touching]
        places = closest_on_triangles(point, self._surface.vertices[triangles])
        best = int(np.linalg.norm(places - point, axis=1).argmin())
        normal = triangle_normals(self._surface.vertices, triangles[best : best + 1])[0]
        return places[best], unit(normal)
