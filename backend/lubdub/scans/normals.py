"""Which way is out, and where the scan ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from lubdub.geometry.surface import Surface, triangle_normals, unit
from lubdub.scans.thin import Cells


@dataclass(frozen=True)
class NormalSettings:
    """How normals are made."""

    neighbours: int = 24
    """Fewer are rough at 2.5 mm noise, more round off nipples; measured on simulated depth frames."""
    border_neighbours: int = 20
    border_offset: float = 0.33
    """On a straight edge the neighbours' mean lies 0.42 radii inside; in the middle of skin, nearly none."""
    tree_neighbours: int = 8
    consistent_share: float = 0.9998
    """Share of shared edges that two triangles walk in opposite directions. All do in a well-wound mesh; a seam
    between two halves, one inside out, is a few hundred edges of a hundred thousand."""
    triangles_looked_at: int = 200_000
    threads: int = 2
    """As many as a small server has cores; how many changes no number."""


SETTINGS = NormalSettings()


@dataclass(frozen=True)
class Neighbourhood:
    """Nearest neighbours of points that do not change any more. index: (n, k), itself first; reach: (n, k) mm."""

    index: np.ndarray
    reach: np.ndarray

    def kept(self, keep: np.ndarray, points: np.ndarray) -> Neighbourhood:
        """The same for the points (n, 3) that are True in keep (n,); only those that lost a neighbour look anew."""
        left, wanted = points[keep], min(self.index.shape[1], int(keep.sum()))
        before = self.index[keep, :wanted]
        index, reach = (np.cumsum(keep) - 1)[before], self.reach[keep, :wanted]
        lost = ~keep[before].all(axis=1)
        if lost.any():
            reach[lost], index[lost] = cKDTree(left).query(left[lost], k=wanted)
        return Neighbourhood(index, reach)


def neighbourhood(points: np.ndarray) -> Neighbourhood:
    """The 24 nearest neighbours (and itself) of each point; fewer when there are fewer points."""
    k = min(SETTINGS.neighbours + 1, len(points))
    reach, index = cKDTree(points).query(points, k=k, workers=SETTINGS.threads)
    return Neighbourhood(index, reach)


def mesh_normals(surface: Surface, cells: Cells) -> np.ndarray | None:
    """(count, 3) mean triangle normal in each cell; None when the winding cannot be trusted.

    The sign is that of the file: all outward or all inward.
    """
    if surface.is_cloud or _consistency(surface.triangles) < SETTINGS.consistent_share:
        return None
    normals = unit(cells.mean(surface.normals))
    return normals if (np.abs(normals).sum(axis=1) > 0).all() else None


def _consistency(triangles: np.ndarray) -> float:
    """Of the edges with two triangles, the share that both walk in opposite directions. Some edges will do."""
    starts, ends = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    low = np.minimum(starts, ends)
    looked_at = low % (len(triangles) // SETTINGS.triangles_looked_at + 1) == 0
    low, starts, ends = low[looked_at], starts[looked_at], ends[looked_at]
    words = np.sort(((low * (int(triangles.max()) + 1) + np.maximum(starts, ends)) << 1) | (starts < ends))
    shared = words[1:] >> 1 == words[:-1] >> 1
    return float((words[1:] != words[:-1])[shared].mean()) if shared.any() else 0.0


def cloud_normals(points: np.ndarray, near: Neighbourhood) -> np.ndarray:
    """(n, 3) unit normals of the local planes, neighbours agreeing with each other; the whole may be inward."""
    # Column by column: a third of the time of one product over all three.
    around = [column[near.index] for column in points.T]
    off = [column - column.mean(axis=1, keepdims=True) for column in around]
    moments = np.empty((len(points), 3, 3))
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        moments[:, i, j] = moments[:, j, i] = np.einsum("nk,nk->n", off[i], off[j])
    normals = np.linalg.eigh(moments)[1][:, :, 0]
    return normals * _agreed_signs(normals, near)[:, None]


def _agreed_signs(normals: np.ndarray, near: Neighbourhood) -> np.ndarray:
    """(n,) +1 or -1 that turns normals to one side, along the tree of least change (Hoppe et al. 1992)."""
    count = len(normals)
    k = min(SETTINGS.tree_neighbours, near.index.shape[1] - 1)
    start, end = np.repeat(np.arange(count), k), near.index[:, 1 : k + 1].ravel()
    alignment = (normals[start] * normals[end]).sum(axis=1)
    cost = 1.001 - np.abs(alignment)
    tree = minimum_spanning_tree(coo_matrix((cost, (start, end)), (count, count)).tocsr())
    parent = _parents(tree, count)
    sign = np.where((normals * normals[parent]).sum(axis=1) < 0, -1.0, 1.0)
    for _ in range(count.bit_length()):
        sign, parent = sign * sign[parent], parent[parent]
    return sign


def _parents(tree: coo_matrix, count: int) -> np.ndarray:
    """(n,) each point's parent in the tree; roots are their own, one in each separate part."""
    parent = np.arange(count)
    parts = connected_components(tree, directed=False)[1]
    for root in np.unique(parts, return_index=True)[1]:
        order, before = breadth_first_order(tree, root, directed=False)
        parent[order[1:]] = before[order[1:]]
    return parent


def turned_outward(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, bool]:
    """The normals with the sign that makes the skin bulge, and whether it had to be changed.

    Skin curves away from its own middle, seen from all round as well as from one side.
    """
    outward = ((points - points.mean(axis=0)) * normals).sum()
    return (-normals, True) if outward < 0 else (normals, False)


def border(points: np.ndarray, normals: np.ndarray, near: Neighbourhood) -> np.ndarray:
    """(n,) bool: True where the neighbours lie to one side, which is the rim of the scan."""
    k = min(SETTINGS.border_neighbours, near.index.shape[1] - 1)
    offset = points[near.index[:, 1 : k + 1]].mean(axis=1) - points
    offset -= (offset * normals).sum(axis=1, keepdims=True) * normals
    return np.asarray(np.linalg.norm(offset, axis=1) > SETTINGS.border_offset * near.reach[:, k])


def wound_like(surface: Surface, normals: np.ndarray) -> Surface:
    """The same surface, each triangle wound so that it faces as its corners' normals (n, 3) do."""
    facing = triangle_normals(surface.vertices, surface.triangles)
    wrong = (facing * normals[surface.triangles].sum(axis=1)).sum(axis=1) < 0
    triangles = surface.triangles.copy()
    triangles[wrong] = triangles[wrong][:, ::-1]
    return Surface(surface.vertices, triangles)
