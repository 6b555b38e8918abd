"""Fewer points, evenly spread: one point for each little cube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_GUESS_SAMPLE = 60_000


@dataclass(frozen=True)
class Cells:
    """Points grouped by the cube they lie in. cell: (n,) number of each point's cube, 0 to count - 1."""

    cell: np.ndarray
    count: int
    size: float

    def mean(self, values: np.ndarray) -> np.ndarray:
        """(count, d) mean of values (n, d) in each cube."""
        weight = np.bincount(self.cell, minlength=self.count)
        columns = [np.bincount(self.cell, column, self.count) / weight for column in values.T]
        return np.stack(columns, axis=1)


def cells_of(points: np.ndarray, size: float) -> Cells:
    """Group points (n, 3) by cubes of edge size."""
    if len(points) == 0:
        return Cells(np.zeros(0, np.int64), 0, size)
    grid = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
    reach = grid.max(axis=0) + 1
    keys = (grid[:, 0] * reach[1] + grid[:, 1]) * reach[2] + grid[:, 2]
    place_bits = len(keys).bit_length()
    if int(np.prod(reach.astype(float))).bit_length() + place_bits > 62:
        _, cell = np.unique(keys, return_inverse=True)
        return Cells(cell.ravel(), int(cell.max()) + 1, size)
    # Sorting key and position as one word is several times faster than sorting keys and carrying positions.
    words = np.sort((keys << place_bits) | np.arange(len(keys)))
    order = words & ((1 << place_bits) - 1)
    sorted_keys = words >> place_bits
    rank = np.concatenate([[0], np.cumsum(sorted_keys[1:] != sorted_keys[:-1])])
    cell = np.empty(len(keys), np.int64)
    cell[order] = rank
    return Cells(cell, int(rank[-1]) + 1, size)


def evenly(points: np.ndarray, at_most: int) -> Cells:
    """Cubes of the smallest edge, to about a tenth, that leave at most `at_most` of them.

    When there are few enough points already, every point keeps a cube of its own.
    """
    if len(points) <= at_most:
        return Cells(np.arange(len(points)), len(points), spacing(points))
    size = _first_guess(points, at_most)
    cells = cells_of(points, size)
    for _ in range(8):
        if cells.count <= at_most and cells.count > 0.8 * at_most:
            break
        size *= float(np.clip(np.sqrt(cells.count / (0.93 * at_most)), 0.5, 2.0))
        finer = cells_of(points, size)
        if finer.count == cells.count and finer.count <= at_most:
            break  # the cloud itself is this sparse, or all its points coincide
        cells = finer
    while cells.count > at_most:
        size *= 1.1
        cells = cells_of(points, size)
    return cells


def _first_guess(points: np.ndarray, at_most: int) -> float:
    """The edge that would be right for a flat sheet of the area that a coarse look shows."""
    sample = points[:: max(len(points) // _GUESS_SAMPLE, 1)]
    coarse = max(float(np.ptp(sample, axis=0).max()) / 60, 1e-9)
    return coarse * float(np.sqrt(cells_of(sample, coarse).count / at_most)) * 0.9


def spacing(points: np.ndarray) -> float:
    """About how far apart neighbouring points are, taken from the area that they cover."""
    if len(points) < 2:
        return 0.0
    coarse = max(float(np.ptp(points, axis=0).max()) / 40, 1e-9)
    covered = cells_of(points, coarse).count * coarse * coarse
    return float(np.sqrt(covered / len(points)))
