"""A light, triangulated copy of the cleaned skin for showing and clicking."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from lubdub.geometry.surface import Surface, unit
from lubdub.scans.normals import wound_like
from lubdub.scans.thin import evenly

MOST_VERTICES = 40_000
_LONGEST_EDGE = 4.0  # times the usual spacing; longer ones would close holes that the scan really has
_ONE_SIDED = 0.45  # length of the mean normal: 0.64 for a half cylinder, about 0 all the way round
_SEAM = 0.4  # radians of overlap where an unrolled body is joined again


def light_mesh(surface: Surface, points: np.ndarray, normals: np.ndarray) -> Surface:
    """The mesh with at most 40,000 vertices, wound outward.

    points, normals: (n, 3) of the cleaned scan, which know the outward side.
    """
    cells = evenly(surface.vertices, MOST_VERTICES)
    vertices = cells.mean(surface.vertices) if cells.count < len(surface.vertices) else surface.vertices
    triangles = cells.cell[surface.triangles]
    a, b, c = triangles.T
    triangles = _once(triangles[(a != b) & (b != c) & (c != a)])
    light = _without_loose(Surface(vertices, triangles))
    return wound_like(light, normals[cKDTree(points).query(light.vertices)[1]])


def _once(triangles: np.ndarray) -> np.ndarray:
    """Each set of three corners once: merging vertices folds triangles onto each other."""
    if len(triangles) == 0:
        return triangles
    low, middle, high = np.sort(triangles, axis=1).T
    base = int(high.max()) + 1
    return triangles[np.unique((low * base + middle) * base + high, return_index=True)[1]]


def _without_loose(surface: Surface) -> Surface:
    used = np.zeros(len(surface.vertices), bool)
    used[surface.triangles.ravel()] = True
    return surface.kept(used)


def draped(points: np.ndarray, normals: np.ndarray) -> Surface:
    """A cloud joined to a skin, wound outward: laid flat when seen from one side, unrolled when all round."""
    view = normals.mean(axis=0)
    if np.linalg.norm(view) > _ONE_SIDED:
        triangles = Delaunay(_laid_flat(points, unit(view))).simplices
    else:
        triangles = _unrolled(points)
    triangles = _short(points, triangles.astype(np.int64))
    return wound_like(Surface(points, triangles), normals)


def _laid_flat(points: np.ndarray, view: np.ndarray) -> np.ndarray:
    first = unit(np.cross(view, np.eye(3)[np.abs(view).argmin()]))
    return np.asarray(points @ np.stack([first, np.cross(view, first)], axis=1))


def _unrolled(points: np.ndarray) -> np.ndarray:
    """Triangles over angle and height about the long axis; a strip is repeated so that the seam closes."""
    off = points - points.mean(axis=0)
    axes = np.linalg.eigh(off.T @ off)[1]
    across, deep, along = (off @ axes[:, [1, 0, 2]]).T
    angle = np.arctan2(deep, across)
    girth = float(np.hypot(across, deep).mean())
    repeated = np.flatnonzero(angle < -np.pi + _SEAM)
    sheet = np.stack([np.concatenate([angle, angle[repeated] + 2 * np.pi]) * girth, np.append(along, along[repeated])])
    owner = np.append(np.arange(len(points)), repeated)
    triangles = owner[Delaunay(sheet.T).simplices]
    a, b, c = triangles.T
    return _once(triangles[(a != b) & (b != c) & (c != a)])


def _short(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    corners = points[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return triangles[longest < _LONGEST_EDGE * np.median(longest)]
