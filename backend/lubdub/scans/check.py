"""What the cleaned scan itself says about its quality, before anything is fitted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.results import CleanScan, Reason
from lubdub.scans.reasons import NOISY_SCAN, SPARSE_SCAN


@dataclass(frozen=True)
class CheckSettings:
    """When to warn."""

    sparse_share: float = 0.0255
    """Spacing over the scan's length: 13 mm on an adult's 500 mm trunk, 9 mm on a baby's 340 mm, which is as fine as a
    phone's LiDAR gets: three such babies had errors of 5 to 8 mm, like babies seen by finer cameras."""
    rough_share: float = 0.008
    """Roughness over the scan's length: 4 mm on an adult. Sensors have 1-2.5 mm; at 5 mm the fit was 1.5 mm worse."""
    patch_share: float = 0.045
    """Radius over the scan's length in which skin counts as flat: 25 mm on an adult, a third of a breast's."""
    neighbours: int = 80
    least_neighbours: int = 12
    sample: int = 1_000


SETTINGS = CheckSettings()


def check_scan(scan: CleanScan) -> tuple[Reason, ...]:
    """Warnings that need no fit: seen while cleaning, far-apart points, rough skin. Empty for a good scan."""
    length = float(np.ptp(scan.points, axis=0).max())
    sample = scan.points[:: max(len(scan.points) // SETTINGS.sample, 1)]
    reach, near = cKDTree(scan.points).query(sample, k=min(SETTINGS.neighbours, len(scan.points)))
    reasons = list(scan.warnings)
    if float(np.median(reach[:, min(4, reach.shape[1] - 1)])) > SETTINGS.sparse_share * length:
        reasons.append(SPARSE_SCAN)
    if _roughness(scan.points[near], reach < SETTINGS.patch_share * length) > SETTINGS.rough_share * length:
        reasons.append(NOISY_SCAN)
    return tuple(reasons)


def _roughness(around: np.ndarray, counts: np.ndarray) -> float:
    """Median over patches of the root mean square distance from the patch's plane, mm; 0 when none is dense enough.

    around: (s, k, 3) points about s places; counts: (s, k) bool, which of them belong to the patch.
    """
    dense = counts.sum(axis=1) >= SETTINGS.least_neighbours
    if not dense.any():
        return 0.0
    around, weight = around[dense], counts[dense, :, None] / counts[dense].sum(axis=1)[:, None, None]
    off = around - (around * weight).sum(axis=1, keepdims=True)
    least = np.linalg.eigvalsh(np.einsum("ski,skj->sij", off * weight, off))[:, 0]
    return float(np.median(np.sqrt(np.maximum(least, 0))))
