"""A light, triangulated copy of the cleaned skin for showing and clicking."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

from lubdub.geometry.surface import Surface, unit
from lubdub.scans.normals import Neighbourhood, wound_like
from lubdub.scans.pieces import connected
from lubdub.scans.thin import evenly

MOST_VERTICES = 40_000
_LONGEST_EDGE = 4.0  # times the usual spacing; longer ones would close holes that the scan really has
_ONE_SIDED = 0.45  # length of the mean normal: 0.64 for a half cylinder, about 0 all the way round
_SEEN = 0.35  # cosine: a corner of a cube faces three of its sides at 0.58
_SHEET_GAP = 2.0  # times the distance to the 4th neighbour
_LEAST_SHEET = 8
_OVERLAP = 0.2  # of 3: views overlap a little rather than leave cracks between them
_EASED_OVER = 10  # neighbours: 2.5 mm noise becomes 0.8 mm, and a nipple keeps most of its height


def begun(make: Callable[[], Surface]) -> Callable[[], Surface]:
    """Begin to make it in a thread. Whoever wants it waits for it, and gets what went wrong there.

    The triangulation lets other threads run, so with a second core it costs the fit beside it nothing.
    """
    with_one_thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="drape")
    skin = with_one_thread.submit(make)
    with_one_thread.shutdown(wait=False)
    return skin.result


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


def draped(points: np.ndarray, normals: np.ndarray, near: Neighbourhood) -> Surface:
    """A cloud joined to a skin, wound outward and eased a little, so that noise does not look like fur.

    Seen from one side it is laid flat and joined there; a body scanned all round, once for each of six sides.
    """
    view = normals.mean(axis=0)
    if np.linalg.norm(view) > _ONE_SIDED:
        triangles = _joined_flat(points, unit(view))
    else:
        triangles = _joined_by_sides(points, normals, near)
    triangles = _short(points, triangles)
    return wound_like(Surface(_eased(points, normals, near), triangles), normals)


def _eased(points: np.ndarray, normals: np.ndarray, near: Neighbourhood) -> np.ndarray:
    """Each point moved along its normal to the height of its nearest neighbours."""
    middle = points[near.index[:, :_EASED_OVER]].mean(axis=1)
    return np.asarray(points + normals * ((middle - points) * normals).sum(axis=1, keepdims=True))


def _joined_flat(points: np.ndarray, view: np.ndarray) -> np.ndarray:
    """(m, 3) Delaunay triangles of the points as seen along view; none when they lie in a line."""
    first = unit(np.cross(view, np.eye(3)[np.abs(view).argmin()]))
    try:
        return np.asarray(Delaunay(points @ np.stack([first, np.cross(view, first)], axis=1)).simplices, np.int64)
    except QhullError:
        return np.zeros((0, 3), np.int64)


def _joined_by_sides(points: np.ndarray, normals: np.ndarray, near: Neighbourhood) -> np.ndarray:
    """Triangles of six views along the body's own axes, each taken from the view that it faces most."""
    off = points - points.mean(axis=0)
    axes = np.linalg.eigh(off.T @ off)[1].T
    sides = np.concatenate([axes, -axes])
    parts = [np.zeros((0, 3), np.int64)]
    for side in sides:
        for sheet in _sheets(points, normals @ side > _SEEN, near):
            triangles = sheet[_joined_flat(points[sheet], side)]
            facing = normals[triangles].sum(axis=1)
            parts.append(triangles[facing @ side > (facing @ sides.T).max(axis=1) - _OVERLAP])
    return _once(np.concatenate(parts))


def _sheets(points: np.ndarray, seen: np.ndarray, near: Neighbourhood) -> Iterator[np.ndarray]:
    """The points seen from a side, sheet by sheet: an arm's outside hides the flank, but does not touch it."""
    chosen = np.flatnonzero(seen)
    if len(chosen) == 0:
        return
    label = connected(points[chosen], _SHEET_GAP * float(np.median(near.reach[:, 4])))
    for number in np.flatnonzero(np.bincount(label) >= _LEAST_SHEET):
        yield chosen[label == number]


def _short(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    corners = points[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return triangles[longest < _LONGEST_EDGE * np.median(longest)]
