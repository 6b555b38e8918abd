"""A surface: points, perhaps joined by triangles, each with its outward normal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Surface:
    """Points and the triangles that join them; a bare cloud has no triangles.

    vertices: (n, 3) float64. triangles: (m, 3) int64, each an index into vertices, counter-clockwise seen
    from outside; m may be 0. Raises ValueError when a shape, a number or an index is not usable.
    """

    vertices: np.ndarray
    triangles: np.ndarray

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        triangles = np.ascontiguousarray(self.triangles, dtype=np.int64).reshape(-1, 3)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise ValueError(f"vertices must be (n, 3), not {vertices.shape}")
        if not np.isfinite(vertices).all():
            raise ValueError("vertices must be finite")
        if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(vertices)):
            raise ValueError("a triangle names a vertex that is not there")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    @property
    def is_cloud(self) -> bool:
        """True when there are points only."""
        return len(self.triangles) == 0

    @cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) unit normals, area-weighted from the triangles; zero where no triangle touches a vertex."""
        return vertex_normals(self.vertices, self.triangles)

    def kept(self, keep: np.ndarray) -> Surface:
        """The part whose vertices are True in keep (n,) bool; triangles that lose a corner go too."""
        new_index = np.cumsum(keep) - 1
        whole = keep[self.triangles].all(axis=1) if len(self.triangles) else np.zeros(0, bool)
        return Surface(self.vertices[keep], new_index[self.triangles[whole]])


def cloud(points: np.ndarray) -> Surface:
    """A surface of points only. points: (n, 3)."""
    return Surface(points, np.zeros((0, 3), np.int64))


def triangle_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(m, 3) normals whose length is twice the triangle's area, right-hand rule."""
    a, b, c = vertices[triangles[:, 0]], vertices[triangles[:, 1]], vertices[triangles[:, 2]]
    return np.cross(b - a, c - a)


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n, 3) unit vertex normals, area-weighted; zero for vertices without a triangle."""
    per_triangle = triangle_normals(vertices, triangles)
    total = np.zeros_like(vertices)
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(triangles[:, corner], per_triangle[:, axis], len(vertices))
    return unit(total)


def unit(vectors: np.ndarray) -> np.ndarray:
    """The same vectors at length 1 along the last axis; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors, dtype=np.float64), where=length > 1e-12)


def edges_of(triangles: np.ndarray) -> np.ndarray:
    """(e, 2) int64: each undirected edge of the triangles once, smaller index first, sorted."""
    return edges_and_uses(triangles)[0]


def edges_and_uses(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edges as in `edges_of`, and (e,) how many triangles use each."""
    count = int(triangles.max(initial=0)) + 1
    first, second = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    # One number for an edge: sorting numbers is ten times as fast as sorting pairs.
    keys = np.minimum(first, second).astype(np.int64) * count + np.maximum(first, second)
    found, uses = np.unique(keys, return_counts=True)
    return np.stack(np.divmod(found, count), axis=1), uses


def carry(barycentric: np.ndarray, corners: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Points fixed to a mesh, wherever its vertices are now.

    barycentric: (k, 3) weights; corners: (k, 3) vertex indices; vertices: (n, 3). Returns (k, 3).
    """
    return np.asarray(np.einsum("kc,kcd->kd", barycentric, vertices[corners]))
