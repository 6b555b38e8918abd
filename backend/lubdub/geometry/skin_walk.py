"""Going along a skin: to the nearest place on it, and so many millimetres to a side or up."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.neighbours import SurfaceFinder
from lubdub.geometry.surface import Surface, unit

STRIDE_MM = 2.0
"""Curved skin is walked in strides so short that each is as good as straight."""
AROUND_MM = 8.0
"""The way the skin faces is asked of so much of it, so that a scan's noise does not turn a stride."""


class SkinWalker:
    """Walks on one surface in the body frame. points, normals: (n, 3) of the same skin, evenly spread, outward."""

    def __init__(self, surface: Surface, points: np.ndarray, normals: np.ndarray) -> None:
        self._finder = SurfaceFinder(surface)
        self._normals = normals
        self._tree = cKDTree(points)

    def nearest(self, place: np.ndarray) -> np.ndarray:
        """(3,) the place on the skin nearest to place (3,)."""
        return self._finder.nearest(place, AROUND_MM)

    def normal(self, place: np.ndarray) -> np.ndarray:
        """(3,) the unit normal of the skin around place (3,)."""
        near = self._tree.query_ball_point(place, AROUND_MM) or [int(self._tree.query(place)[1])]
        return unit(self._normals[near].mean(axis=0))

    def walk(self, place: np.ndarray, left_mm: float, up_mm: float) -> np.ndarray:
        """(3,) on the skin, so far along it from place (3,): towards the patient's left, and towards the head."""
        here = self.nearest(place)
        length = float(np.hypot(left_mm, up_mm))
        strides = max(1, round(length / STRIDE_MM))
        way = np.array([left_mm, up_mm, 0.0]) / strides
        for _ in range(strides if length > 0 else 0):
            normal = self.normal(here)
            along = way - (way @ normal) * normal
            here = self.nearest(here + float(np.linalg.norm(way)) * unit(along))
        return here
