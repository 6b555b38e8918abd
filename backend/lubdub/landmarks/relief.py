"""The skin around a place as a map of heights, seen along its own direction.

Lengths inside a map are in units of the body's size (about a breastbone), so that one yardstick serves all ages.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from lubdub.geometry.colour import Tint
from lubdub.geometry.surface import unit

CELL = 0.02
"""Side of a map's cell: 3 mm on an adult, as far apart as the points of a cleaned scan."""
BLUR = 0.025
"""Heights are averaged over this radius, and over wider ones where there are too few points."""
WIDER = (3 * BLUR, 0.15)
FACING = 0.2
"""Cosine: skin that is turned further away from the viewer is not in the map."""
UNSEEN = 0.04
"""Farther than this from every point the skin was not scanned."""
DIRECTION_REACH = 0.3
"""A place's own direction is the mean of the skin's around it."""
RIM = 0.1
"""A map is made with so much around it, which is then cut off."""
TREND_REACH, TREND_SCALE, OUTLIER = 0.5, 0.1, 0.35
"""Heights stand over a bowl fitted to the skin around; beyond OUTLIER from it lies something else."""
FEW = 0.02
"""Share of the usual number of points below which a wider average takes over."""
GRAIN_BLUR = 0.05


@dataclass(frozen=True)
class Skin:
    """The trunk's scanned skin, no arms. points: (n, 3); normals: (n, 3); size: mm of the unit of length; tint: the
    colours of what lies on it and around, in the body frame, where the scan has any."""

    points: np.ndarray
    normals: np.ndarray
    size: float
    tint: Tint | None = None

    def direction(self, place: np.ndarray) -> np.ndarray:
        """(3,) which way the skin around a place (3,) faces."""
        squared = ((self.points - place) ** 2).sum(axis=1)
        weights = np.exp(-0.5 * squared / (DIRECTION_REACH * self.size) ** 2)
        return unit(weights @ self.normals)

    def under(self, window: Window, place: np.ndarray) -> np.ndarray:
        """(3,) the skin behind a place (2,) of a window, outwards and up: points of a scan may be 5 mm apart.

        Where no point is near, the nearest one: skin that nobody saw has no place.
        """
        facing = np.flatnonzero(self.normals @ window.axes[2] > FACING)
        seen = window.seen(self.points[facing])
        nearest = ((seen[:, :2] - place) ** 2).sum(axis=1).argmin()
        point, normal = seen[nearest], window.axes @ self.normals[facing[nearest]]
        step = place - point[:2]
        if np.hypot(*step) > UNSEEN:
            return self.points[facing[nearest]].copy()
        depth = point[2] - normal[:2] @ step / normal[2]
        return np.asarray(window.centre + window.size * np.array([*place, depth]) @ window.axes)


@dataclass(frozen=True)
class Window:
    """Where a map looks. centre: (3,); axes: (3, 3) rows outwards from the midline, towards the head, towards the
    viewer; size: mm of the unit of length; half: (2,) cells to either side of the centre, outwards and up."""

    centre: np.ndarray
    axes: np.ndarray
    size: float
    half: tuple[int, int]

    def seen(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points of the body frame: outwards, up, towards the viewer, in units of length."""
        return np.asarray((points - self.centre) @ self.axes.T / self.size)


def window_at(skin: Skin, place: np.ndarray, side: float, half: tuple[int, int]) -> Window:
    """A window on the skin nearest to a place (3,). side: 1 where outwards is the patient's left, -1 where right."""
    centre = skin.points[((skin.points - place) ** 2).sum(axis=1).argmin()]
    front = skin.direction(centre)
    up = unit(np.array([0.0, 1.0, 0.0]) - front[1] * front)
    return Window(centre, np.stack([side * np.cross(up, front), up, front]), skin.size, half)


def relief(skin: Skin, window: Window) -> np.ndarray:
    """(rows, columns) heights over the bowl that fits the skin around, in units of length."""
    rim = round(RIM / CELL)
    columns, rows = (2 * (cells + rim) + 1 for cells in window.half)
    places = window.seen(skin.points)
    reach = CELL * (np.array(window.half) + rim + 0.5)
    inside = (skin.normals @ window.axes[2] > FACING) & (np.abs(places[:, :2]) < reach).all(axis=1)
    places = places[inside & (np.abs(places[:, 2]) < 1.0)]
    if not len(places):
        return np.zeros((rows - 2 * rim, columns - 2 * rim))
    heights = _over_bowl(places)
    near = np.abs(heights) < OUTLIER
    column, row = (np.rint(places[near, axis] / CELL).astype(int) + window.half[axis] + rim for axis in (0, 1))
    cells = row * columns + column
    count = np.bincount(cells, minlength=rows * columns).reshape(rows, columns).astype(float)
    total = np.bincount(cells, heights[near], rows * columns).reshape(rows, columns)
    return _averaged(total, count)[rim:-rim, rim:-rim]


def _over_bowl(places: np.ndarray) -> np.ndarray:
    """(n,) heights of places (n, 3) over a quadric fitted robustly around the middle."""
    x, y, z = places.T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    nearness = np.exp(-0.5 * (x * x + y * y) / TREND_REACH**2)
    weights = nearness
    for _ in range(3):
        weighted = terms * weights
        rest = z - np.linalg.solve(weighted @ terms.T + 1e-9 * np.eye(6), weighted @ z) @ terms
        weights = nearness / (1 + (rest / TREND_SCALE) ** 2)
    return np.asarray(rest)


def _averaged(total: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Blurred mean heights; where the narrow blur met too few points, the wider one's. total, count: of each cell."""
    few = FEW * float(np.median(count[count > 0])) if count.any() else 1.0
    heights = np.zeros_like(total)
    for radius in (*WIDER[::-1], BLUR):
        sums, points = (gaussian_filter(one, radius / CELL, truncate=3.0) for one in (total, count))
        share = points / (points + few)
        heights = share * sums / np.maximum(points, 1e-12) + (1 - share) * heights
    return heights


def grain(heights: np.ndarray) -> float:
    """One standard deviation of what is finer than a nipple's hill: the scan's noise, and the skin's own relief."""
    fine = heights - gaussian_filter(heights, GRAIN_BLUR / CELL)
    return float(1.4826 * np.median(np.abs(fine - np.median(fine))))
