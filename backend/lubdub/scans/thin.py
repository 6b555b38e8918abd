"""Fewer points, evenly spread: one point for each little cube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_GUESS_SAMPLE = 60_000
_SAMPLE_PER_CELL = 8  # so many points per cube leave next to none of them empty


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

    def kept(self, keep: np.ndarray) -> Cells:
        """Only the cubes that are True in keep (count,), and the points in them."""
        number = np.cumsum(keep) - 1
        return Cells(number[self.cell[keep[self.cell]]], int(keep.sum()), self.size)


def bounds(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(d,) least and (d,) greatest coordinates of points (n, d); column by column, which is the fast way."""
    columns = list(points.T)
    return np.array([column.min() for column in columns]), np.array([column.max() for column in columns])


def _longest_side(points: np.ndarray) -> float:
    low, high = bounds(points)
    return float((high - low).max())


def cells_of(points: np.ndarray, size: float) -> Cells:
    """Group points (n, 3) by cubes of edge size."""
    if len(points) == 0:
        return Cells(np.zeros(0, np.int64), 0, size)
    low, high = bounds(points)
    reach = ((high - low) / size).astype(np.int64) + 1
    x, y, z = (((column - start) / size).astype(np.int64) for column, start in zip(points.T, low, strict=True))
    keys = (x * reach[1] + y) * reach[2] + z
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
    sample = points[:: max(len(points) // (_SAMPLE_PER_CELL * at_most), 1)]
    size = _first_guess(sample, at_most)
    for _ in range(8):
        count = cells_of(sample, size).count
        if 0.82 * at_most < count < 0.98 * at_most:
            break
        size *= float(np.clip(np.sqrt(count / (0.9 * at_most)), 0.5, 2.0))
    cells = cells_of(points, size)
    while cells.count > at_most:
        size *= 1.08
        cells = cells_of(points, size)
    return cells


def _first_guess(points: np.ndarray, at_most: int) -> float:
    """The edge that would be right for a flat sheet of the area that a coarse look shows."""
    sample = points[:: max(len(points) // _GUESS_SAMPLE, 1)]
    coarse = max(_longest_side(sample) / 60, 1e-9)
    return coarse * float(np.sqrt(cells_of(sample, coarse).count / at_most)) * 0.9


def spacing(points: np.ndarray) -> float:
    """About how far apart neighbouring points are, taken from the area that they cover."""
    if len(points) < 2:
        return 0.0
    coarse = max(_longest_side(points) / 40, 1e-9)
    covered = cells_of(points, coarse).count * coarse * coarse
    return float(np.sqrt(covered / len(points)))
