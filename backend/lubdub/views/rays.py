"""Where a ray of sight meets the skin: taps, the crosshair, and things laid on the skin."""

from __future__ import annotations

import numpy as np

from lubdub.geometry.surface import Surface, triangle_normals, unit

GRAZING = 1e-12
"""A triangle seen this edge-on (determinant) is not hit."""


class SkinRays:
    """Casts rays against one surface, the same triangles that are shown."""

    def __init__(self, surface: Surface) -> None:
        corners = surface.vertices[surface.triangles]
        self._origin = corners[:, 0]
        self._edge1 = corners[:, 1] - corners[:, 0]
        self._edge2 = corners[:, 2] - corners[:, 0]
        self._normal = unit(triangle_normals(surface.vertices, surface.triangles))

    def hit(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
        """(3,) the first place the ray from origin (3,) along direction (3,) meets, or None."""
        found = self.hit_with_normal(origin, direction)
        return None if found is None else found[0]

    def hit_with_normal(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """The first place met (3,) and the outward normal there (3,), or None.

        Möller and Trumbore, Fast minimum storage ray-triangle intersection (1997), over all triangles at once.
        """
        across = np.cross(direction, self._edge2)
        determinant = (self._edge1 * across).sum(1)
        usable = np.abs(determinant) > GRAZING
        inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=usable)
        offset = origin - self._origin
        u = (offset * across).sum(1) * inverse
        other = np.cross(offset, self._edge1)
        v = (other @ direction) * inverse
        distance = (self._edge2 * other).sum(1) * inverse
        met = usable & (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
        if not met.any():
            return None
        first = int(np.where(met, distance, np.inf).argmin())
        return origin + distance[first] * direction, self._normal[first]


def near(surface: Surface, centre: np.ndarray, radius: float) -> Surface:
    """The part of a surface within radius of centre (3,), so that many rays stay cheap."""
    return surface.kept(np.linalg.norm(surface.vertices - centre, axis=1) <= radius)
