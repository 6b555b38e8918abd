"""Where a line of sight first meets the skin: for drawing without a graphics card, and for clicks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lubdub.geometry.one_thread import one_threaded_open3d
from lubdub.geometry.surface import Surface, unit


@dataclass(frozen=True)
class Hits:
    """What k rays met. met: (k,) bool; triangle: (k,) int64 and weights: (k, 3) barycentric, both meaningless
    where nothing was met; points: (k, 3) to about a thousandth of a millimetre, NaN where nothing was met."""

    met: np.ndarray
    triangle: np.ndarray
    weights: np.ndarray
    points: np.ndarray


class SkinCaster:
    """Casts rays at one triangulated surface. Raises ValueError for a cloud, which has nothing to meet."""

    def __init__(self, surface: Surface) -> None:
        open3d = one_threaded_open3d()

        if surface.is_cloud:
            raise ValueError("a cloud has no skin to meet; triangulate it first")
        # Open3D casts in float32: keep the numbers small by casting about the surface's middle.
        self._middle = (surface.vertices.min(0) + surface.vertices.max(0)) / 2
        core: Any = open3d.core  # its stub knows no numpy arrays
        self._tensor = core.Tensor
        self._scene = open3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(
            self._tensor(np.ascontiguousarray(surface.vertices - self._middle, np.float32)),
            self._tensor(np.ascontiguousarray(surface.triangles, np.uint32)),
        )

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """The first meeting of each ray. origins, directions: (k, 3), or one of them (3,) for all rays."""
        origins, directions = np.broadcast_arrays(np.atleast_2d(origins), unit(np.atleast_2d(directions)))
        rays = np.concatenate([origins - self._middle, directions], axis=1).astype(np.float32)
        answer = self._scene.cast_rays(self._tensor(rays))
        met = np.isfinite(answer["t_hit"].numpy())
        triangle = np.where(met, answer["primitive_ids"].numpy().astype(np.int64), 0)
        second, third = answer["primitive_uvs"].numpy().astype(np.float64).T
        weights = np.stack([1 - second - third, second, third], axis=1)
        distance = np.where(met, answer["t_hit"].numpy(), np.nan).astype(np.float64)
        points = origins + distance[:, None] * directions
        return Hits(met, triangle, weights, points)

    def distances(self, points: np.ndarray) -> np.ndarray:
        """(k,) how far points (k, 3) lie from the surface, unsigned, to about a thousandth of a millimetre."""
        moved = np.ascontiguousarray(points - self._middle, np.float32)
        return np.asarray(self._scene.compute_distance(self._tensor(moved)).numpy(), np.float64)

    def hit(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
        """(3,) where the ray from origin (3,) along direction (3,) first meets the skin, or None."""
        hits = self.cast(origin, direction)
        return hits.points[0] if hits.met[0] else None
