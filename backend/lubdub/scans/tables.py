"""Numbers out of lines of text, quickly and strictly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lubdub.scans.limits import fan
from lubdub.scans.reasons import unreadable


def number_table(
    lines: Sequence[bytes], columns: Sequence[int], whole: bool = False, separator: str | None = None
) -> np.ndarray:
    """(len(lines), len(columns)) float64, or int64 when whole; separator None means blanks.

    Raises ScanUnreadable when a line is short, holds something else than numbers, or is blank.
    """
    if not lines:
        return np.zeros((0, len(columns)), np.int64 if whole else np.float64)
    try:
        table = np.loadtxt(
            lines,
            dtype=np.int64 if whole else np.float64,
            comments=None,
            delimiter=separator,
            usecols=tuple(columns),
            ndmin=2,
        )
    except (ValueError, OverflowError, IndexError) as error:
        raise unreadable("bad_number") from error
    if len(table) != len(lines):
        raise unreadable("cut_short")
    return table


def check_columns(lines: Sequence[bytes], columns: int, separator: bytes | None = None) -> None:
    """Raises ScanUnreadable unless every line has so many columns: one that has not was cut or joined to another."""
    if any(len(line.split(separator)) != columns for line in lines):
        raise unreadable("bad_number")


def polygon_table(lines: Sequence[bytes], corner_counts: np.ndarray, first_column: int) -> np.ndarray:
    """(m, 3) int64 triangles from lines that list polygons.

    corner_counts: (len(lines),) corners of each; first_column: where the first corner's index stands.
    """
    parts = []
    for corners in np.unique(corner_counts):
        chosen = [lines[row] for row in np.flatnonzero(corner_counts == corners).tolist()]
        if not chosen or corners < 3:
            raise unreadable("bad_face")
        parts.append(fan(number_table(chosen, range(first_column, first_column + int(corners)), whole=True)))
    return np.concatenate(parts) if parts else np.zeros((0, 3), np.int64)
