"""What the skin looks like where a landmark lies, learned from simulated scans: evidence for every place of a map.

A square patch of a map passes a few learned filters. Their answers, and the products of every two of them, are
weighed; how, depends on how grainy the map is. The weights were chosen so that the evidence, added to the logarithm
of the prior, is the logarithm of the posterior: a conditional logistic regression over places.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from lubdub.geometry.signs import Sign
from lubdub.landmarks.relief import CELL

PATCH_CELLS, PATCH_STEP = 7, 2
"""A patch has 15 by 15 heights, every second cell: 0.28 lengths to either side. 0.4 was no better, 0.6 much worse."""
MARGIN = PATCH_CELLS * PATCH_STEP
SATURATED = 3.0
"""No filter's answer counts for more than this, in standard deviations: what is unlike all skin seen proves nothing."""
GRAINS = (0.0008, 0.008)
"""Between these a map's grain changes the weights."""
_FLAT_REACH = 0.2


def patches(heights: np.ndarray, step: int = 1) -> np.ndarray:
    """(places, 225) the patch around every `step`-th cell that is at least MARGIN from the rim."""
    size = 2 * MARGIN + 1
    windows = sliding_window_view(heights, (size, size))[::step, ::step, ::PATCH_STEP, ::PATCH_STEP]
    return windows.reshape(-1, (2 * PATCH_CELLS + 1) ** 2)


def levelled() -> np.ndarray:
    """(225, 225) what takes the slope out of a patch: patch @ levelled()."""
    steps = CELL * PATCH_STEP * np.arange(-PATCH_CELLS, PATCH_CELLS + 1)
    across, along = (axis.ravel() for axis in np.meshgrid(steps, steps))
    plane = np.stack([np.ones_like(across), across, along], axis=1)
    weights = np.exp(-0.5 * (across**2 + along**2) / _FLAT_REACH**2)[:, None]
    return np.eye(len(plane)) - weights * plane @ np.linalg.solve(plane.T @ (weights * plane), plane.T)


def answers(sign: Sign, heights: np.ndarray, step: int = 1) -> np.ndarray:
    """(places, k + k (k + 1) / 2) the filters' answers, saturated, and their products."""
    found = patches(heights, step) @ sign.filters - sign.usual
    found = found / np.sqrt(1 + (found / SATURATED) ** 2)
    one, other = np.triu_indices(found.shape[1])
    return np.concatenate([found, found[:, one] * found[:, other]], axis=1)


def graininess(grain: float) -> float:
    """0 for the finest maps, 1 for the grainiest."""
    low, high = np.log(GRAINS)
    return float(np.clip((np.log(max(grain, 1e-9)) - low) / (high - low), 0.0, 1.0))


def evidence(sign: Sign, heights: np.ndarray, grain: float) -> np.ndarray:
    """(rows - 2 MARGIN, columns - 2 MARGIN) the logarithm of how much more likely a map makes each place."""
    coarse = graininess(grain)
    weights = (1 - coarse) * sign.weights[0] + coarse * sign.weights[1]
    rows, columns = (side - 2 * MARGIN for side in heights.shape)
    return (answers(sign, heights) @ weights).reshape(rows, columns)
