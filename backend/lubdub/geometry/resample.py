"""The same surface with more or fewer points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.surface import Surface, edges_and_uses, edges_of, triangle_normals


def subdivided(surface: Surface, longest_edge_mm: float) -> Surface:
    """The same skin, cut until no edge is longer than longest_edge_mm.

    Every long edge is halved for both triangles that share it, so that no crack opens. Old vertices keep
    their index; the answer is the same on every machine. Raises ValueError for a length that is not positive.
    """
    if not longest_edge_mm > 0:
        raise ValueError("the longest edge must be positive")
    while True:
        edges = edges_of(surface.triangles)
        length = np.linalg.norm(surface.vertices[edges[:, 0]] - surface.vertices[edges[:, 1]], axis=1)
        long = edges[length > longest_edge_mm]
        if len(long) == 0:
            return surface
        surface = _halved(surface, long)


def _halved(surface: Surface, edges: np.ndarray) -> Surface:
    """Cut the given edges (e, 2), smaller index first and sorted, in their middle."""
    count = len(surface.vertices)
    middles = surface.vertices[edges].mean(axis=1)
    keys = edges[:, 0] * count + edges[:, 1]
    corners = surface.triangles
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    side_keys = sides[..., 0] * count + sides[..., 1]
    place = np.minimum(np.searchsorted(keys, side_keys), len(keys) - 1)
    middle = np.where(keys[place] == side_keys, count + place, -1)
    pieces = [_pieces(corners, middle, cuts) for cuts in range(4)]
    return Surface(np.concatenate([surface.vertices, middles]), np.concatenate(pieces))


def _pieces(corners: np.ndarray, middle: np.ndarray, cuts: int) -> np.ndarray:
    """What replaces triangles with `cuts` sides to cut. middle: (m, 3) vertex on the side after each corner."""
    of_these = (middle >= 0).sum(axis=1) == cuts
    corners, middle = corners[of_these], middle[of_these]
    # Turn each triangle so that the odd side out (the only one cut, or the only one whole) is its first.
    odd = (middle >= 0) if cuts == 1 else (middle < 0)
    order = (odd.argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(corners, order, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, order, axis=1).T
    patterns = {
        0: [(a, b, c)],
        1: [(a, ab, c), (ab, b, c)],
        2: [(a, b, bc), (a, bc, ca), (ca, bc, c)],
        3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
    }
    return np.concatenate([np.stack(piece, axis=1) for piece in patterns[cuts]])


def front_shell(surface: Surface, least_forward: float = 0.05) -> Surface:
    """The largest connected part of a body's skin that faces the front, as a camera above it sees it.

    least_forward: the smallest z of a vertex normal that still counts as facing forward.
    Raises ValueError when nothing faces the front.
    """
    forward = surface.kept(surface.normals[:, 2] > least_forward)
    if forward.is_cloud:
        raise ValueError("no part of this surface faces the front")
    piece = _pieces_of(forward)
    part = forward.kept(piece == np.bincount(piece).argmax())
    used = np.zeros(len(part.vertices), bool)
    used[part.triangles] = True
    return part.kept(used)


def _pieces_of(surface: Surface) -> np.ndarray:
    """(n,) which connected piece each vertex belongs to."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = edges_of(surface.triangles)
    count = len(surface.vertices)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def rim_of(surface: Surface) -> np.ndarray:
    """(n,) bool: True for vertices on an edge that only one triangle uses."""
    edges, uses = edges_and_uses(surface.triangles)
    rim = np.zeros(len(surface.vertices), bool)
    rim[edges[uses == 1]] = True
    return rim


def area_mm2(surface: Surface) -> float:
    """The area of a triangulated surface."""
    return float(np.linalg.norm(triangle_normals(surface.vertices, surface.triangles), axis=1).sum() / 2)


@dataclass(frozen=True)
class Thinned:
    """Points left by `thin`. points, normals: (k, 3); marked: (k,) bool, True where any point of the cube was."""

    points: np.ndarray
    normals: np.ndarray
    marked: np.ndarray


def thin(points: np.ndarray, normals: np.ndarray, marked: np.ndarray, spacing_mm: float) -> Thinned:
    """One of the given points for every cube of side spacing_mm: the one nearest to the mean of its cube.

    points, normals: (n, 3); marked: (n,) bool. The order of the points does not matter.
    """
    cubes = np.floor((points - points.min(axis=0)) / spacing_mm).astype(np.int64)
    _, many, deep = cubes.max(axis=0) + 1
    _, cube = np.unique((cubes[:, 0] * many + cubes[:, 1]) * deep + cubes[:, 2], return_inverse=True)
    size = np.bincount(cube)
    mean = np.stack([np.bincount(cube, points[:, axis]) for axis in range(3)], axis=1) / size[:, None]
    away = np.linalg.norm(points - mean[cube], axis=1)
    order = np.lexsort((away, cube))
    chosen = order[np.searchsorted(cube[order], np.arange(len(size)))]
    return Thinned(points[chosen], normals[chosen], np.bincount(cube, marked) > 0)


def spread_points(surface: Surface, spacing_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Points all over a surface's triangles, none farther than about spacing_mm from the next.

    Returns (k, 3) points, those on shared edges more than once, and (k,) bool, True for points on the rim.
    """
    corners = surface.vertices[surface.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    cuts = np.maximum(1, np.ceil(sides.max(axis=1) / spacing_mm)).astype(np.int64)
    rim = rim_of(surface)[surface.triangles].astype(np.float64)
    points, on_rim = [], []
    for count in np.unique(cuts):
        grid = [(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]
        weights = np.array(grid) / count
        these = cuts == count
        points.append(np.einsum("wc,mcd->mwd", weights, corners[these]).reshape(-1, 3))
        on_rim.append((rim[these] @ weights.T).ravel() > 1 - 1e-9)
    return np.concatenate(points), np.concatenate(on_rim)
