"""Turning a scan whose lie nobody knows, a quarter at a time, until it stands upright on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from lubdub.geometry.frames import Similarity
from lubdub.results import CleanScan

Turn = Literal["roll", "spin", "tip"]
"""roll: clockwise on the screen; spin: the right side comes to the front; tip: the top comes to the front."""

TURNS: tuple[Turn, ...] = get_args(Turn)
QUARTERS = {
    "roll": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "spin": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "tip": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}


def turned(scan: CleanScan, turns: Sequence[str]) -> CleanScan:
    """The scan after these quarter turns, its upper, front edge where it was. Without turns the scan itself."""
    if not turns:
        return scan
    rotation = np.eye(3)
    for way in turns:
        rotation = QUARTERS[way] @ rotation
    spun = scan.points @ rotation.T
    corner = np.array([(spun[:, 0].min() + spun[:, 0].max()) / 2, spun[:, 1].max(), spun[:, 2].max()])
    return scan.moved(Similarity(1.0, rotation, -corner))
