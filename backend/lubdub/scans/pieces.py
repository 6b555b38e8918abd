"""The connected pieces of a cloud, and which of them are the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from lubdub.scans.thin import bounds


@dataclass(frozen=True)
class PieceSettings:
    """Lengths in millimetres unless said."""

    gap_in_spacings: float = 3.2
    """Points farther apart than this many point spacings are not joined."""
    gap_least: float = 8.0
    landmark_reach: float = 40.0
    """A click may be this far off the skin and still name its piece."""
    companion_share: float = 0.05
    companion_gap: float = 30.0
    """Pieces of at least this share of the largest and within this gap belong to it: a chest scanned in strips."""
    most_tries: int = 10
    """How many pieces, the largest first, may turn out too flat or short before the largest is taken anyway."""
    rival_share: float = 0.5
    """A second piece with this share of the first one's points may be a second person."""
    least_length: float = 80.0
    """Shorter than a premature baby's chest from notch to navel."""
    flattest: float = 0.05
    """A body is deeper than this share of its breadth, a wall or a sheet is not."""


SETTINGS = PieceSettings()


@dataclass(frozen=True)
class Pieces:
    """keep: (n,) bool; kept of total pieces that are worth naming; rival: a second one about as large was dropped."""

    keep: np.ndarray
    kept: int
    total: int
    rival: bool


def choose_pieces(points: np.ndarray, spacing: float, landmarks: np.ndarray) -> Pieces:
    """Keep the pieces with the landmarks, or else the largest, and what belongs to them.

    points: (n, 3) in mm, evenly spread at about `spacing`; landmarks: (k, 3), k may be 0.
    """
    label = connected(points, max(SETTINGS.gap_in_spacings * spacing, SETTINGS.gap_least))
    sizes = np.bincount(label)
    main = _main_pieces(points, label, sizes, landmarks)
    largest = sizes[list(main)].max()
    worth_naming = np.flatnonzero(sizes >= SETTINGS.companion_share * largest)
    main_tree = cKDTree(points[np.isin(label, list(main))])
    companions = {
        int(piece)
        for piece in worth_naming
        if piece not in main and main_tree.query(points[label == piece])[0].min() < SETTINGS.companion_gap
    }
    rival = any(
        sizes[piece] >= SETTINGS.rival_share * largest and is_body_like(points[label == piece])
        for piece in worth_naming
        if piece not in main | companions
    )
    keep = np.isin(label, list(main | companions))
    return Pieces(keep, len(main | companions), len(set(worth_naming.tolist()) | main), rival)


def connected(points: np.ndarray, gap: float) -> np.ndarray:
    """(n,) number of each point's piece; points (n, 3) no farther apart than gap are in one piece."""
    pairs = cKDTree(points).query_pairs(gap, output_type="ndarray")
    joined = coo_matrix((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), (len(points), len(points)))
    return np.asarray(connected_components(joined, directed=False)[1])


def _main_pieces(points: np.ndarray, label: np.ndarray, sizes: np.ndarray, landmarks: np.ndarray) -> set[int]:
    if len(landmarks):
        distance, nearest = cKDTree(points).query(landmarks)
        named = {int(piece) for piece in label[nearest[distance < SETTINGS.landmark_reach]]}
        if named:
            return named
    for piece in np.argsort(-sizes, kind="stable")[: SETTINGS.most_tries]:
        if is_body_like(points[label == piece]):
            return {int(piece)}
    return {int(sizes.argmax())}


def is_body_like(points: np.ndarray) -> bool:
    """Long and deep enough to be somebody's chest. points: (n, 3) mm."""
    if len(points) < 4:
        return False
    off = points - points.mean(axis=0)
    axes = np.linalg.eigh(off.T @ off)[1]
    low, high = bounds(off @ axes)
    depth, breadth, length = np.sort(high - low)
    return bool(length > SETTINGS.least_length and depth > SETTINGS.flattest * breadth)
