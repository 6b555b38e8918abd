"""How far apart two point sets lie: the Chamfer distance of the paper's eq. 1.

Eq. 1 as printed sums, in its first term, over x in S2 the distance to the nearest y in S2, which is always
zero; x must run over S1. Its text speaks of squared distances where the formula has plain ones: plain ones
are used here, so that the answer is in millimetres. And a sum grows with the number of points, so that a
dense body looks unlike everything: each direction is a mean, and the two means are averaged.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def chamfer_mm(first: np.ndarray, second: np.ndarray, keep: float = 1.0) -> float:
    """The mean gap between two point sets, both ways. first: (n, 3); second: (m, 3).

    keep: the share of each direction's smallest gaps that count, 1 for all; less trims what only one of
    the two covers. Raises ValueError when a set is empty or keep is not in (0, 1].
    """
    return (one_way_mm(first, second, keep) + one_way_mm(second, first, keep)) / 2


def one_way_mm(points: np.ndarray, others: np.ndarray, keep: float = 1.0) -> float:
    """The mean distance from points (n, 3) to the nearest of others (m, 3); keep as in `chamfer_mm`."""
    if len(points) == 0 or len(others) == 0:
        raise ValueError("the distance to an empty point set is not defined")
    return trimmed_mean(cKDTree(others).query(points)[0], keep)


def trimmed_mean(gaps: np.ndarray, keep: float) -> float:
    """The mean of the smallest gaps. gaps: (n,), n > 0; keep: their share, in (0, 1]."""
    if not 0 < keep <= 1:
        raise ValueError("keep must lie in (0, 1]")
    return float(np.sort(gaps)[: max(1, int(np.ceil(keep * len(gaps))))].mean())
