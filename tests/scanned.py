"""Clean scans made straight from surfaces, for tests of what comes after cleaning."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.results import CleanScan, Unit


def clean_scan(
    surface: Surface, front: np.ndarray | None = None, noise_mm: float = 1.0, count: int = 8000
) -> CleanScan:
    """count noisy points of a surface; front: (3,) direction of the one camera, None for all around."""
    mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, 3 * count, seed=1)
    normals = np.asarray(mesh.face_normals[faces])
    seen = np.ones(len(points), bool) if front is None else normals @ front > 0.2
    points, normals = np.asarray(points)[seen][:count], normals[seen][:count]
    points = points + np.random.default_rng(1).normal(0, noise_mm, points.shape)
    distance, nearest = cKDTree(points).query(points, k=20)
    offset = points[nearest].mean(axis=1) - points
    offset -= (offset * normals).sum(1, keepdims=True) * normals
    border = np.linalg.norm(offset, axis=1) / distance[:, -1] > 0.33
    return CleanScan(points, normals, border, lambda: surface, Similarity.identity(), Unit("mm", 1.0, "given"))
