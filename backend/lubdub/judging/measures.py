"""Numbers about a result that say whether it can be trusted."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from lubdub.results import BONE_LANDMARKS, CleanScan, Fit, Landmarks


def chest_coverage(scan: CleanScan, places: np.ndarray, size: float) -> float:
    """Share of the chest's front, around the breastbone and the four places, that has scanned skin.

    places: (k, 3) points of the chest, body frame: the areas and the bone points; size: share of an adult's
    breastbone. A grid of 8 mm cells (scaled) over their frontal rectangle, counted when skin lies within one
    chestpiece's radius.
    """
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    step = 8.0 * size
    grid = np.stack(np.meshgrid(*(np.arange(a, b + step, step) for a, b in zip(low, high, strict=True))), axis=-1)
    facing = scan.points[scan.normals[:, 2] > 0.1]
    if not len(facing):
        return 0.0
    distance = cKDTree(facing[:, :2]).query(grid.reshape(-1, 2))[0]
    return float(np.mean(distance < 12.0 * size))


def chest_rise(scan: CleanScan, landmarks: Landmarks) -> float | None:
    """How much the skin rises to the front from the notch to two thirds down the breastbone, in its lengths.

    `verdict.Gates` says how much fronts and backs rise. Depth is the median of the skin within 0.12 lengths.
    None without both bone points or skin there.
    """
    if not all(name in landmarks for name in BONE_LANDMARKS):
        return None
    notch, joint = (landmarks[name].position for name in BONE_LANDMARKS)
    length = float(np.linalg.norm(notch - joint))
    facing = scan.points[scan.normals[:, 2] > 0]
    if length == 0 or not len(facing):
        return None
    depths = []
    for place in (notch, notch + (joint - notch) * 2 / 3):
        near = np.linalg.norm(facing[:, :2] - place[:2], axis=1) < 0.12 * length
        if not near.any():
            return None
        depths.append(float(np.median(facing[near, 2])))
    return (depths[1] - depths[0]) / length


def landmark_residual(fit: Fit, landmarks: Landmarks) -> dict[str, float]:
    """`landmark_residual_mm`: root mean square distance from clicked landmarks to the body's own; empty without."""
    clicked = [name for name, landmark in landmarks.items() if landmark.is_marked]
    if not clicked:
        return {}
    offsets = [fit.landmarks[name] - landmarks[name].position for name in clicked]
    return {"landmark_residual_mm": float(np.sqrt(np.mean(np.sum(np.square(offsets), axis=1))))}
