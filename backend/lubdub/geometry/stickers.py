"""The printed stickers: which there are, what is on them, and what was read of one on a scan.

Each carries a mark of the AprilTag family 25h9 (Olson 2011; 7 by 7 squares, the outer ones black). The four used are
those whose mirror images differ in 7 squares or more from every mark of the family, turned in any way; two marks of the
family differ in 9 or more. So two wrongly seen squares can neither turn a mirrored mark into a valid one nor one
sticker into another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

FAMILY = "tag25h9"
MARK_CELLS = 7
"""Squares along a mark's side, with its black rim."""

Bone = Literal["suprasternal_notch", "xiphisternum"]
BONES: tuple[Bone, ...] = ("suprasternal_notch", "xiphisternum")
StickerSize = Literal["small", "large"]


@dataclass(frozen=True)
class Sticker:
    """One round sticker. number: of its mark in the family; cell_mm: side of one square.

    inside: (5 rows) of the mark within its rim, from the top; # is black.
    """

    bone: Bone
    size: StickerSize
    number: int
    diameter_mm: float
    cell_mm: float
    inside: tuple[str, str, str, str, str]

    @property
    def mark_mm(self) -> float:
        """Side of the mark's black outline."""
        return MARK_CELLS * self.cell_mm

    def cells(self) -> np.ndarray:
        """(7, 7) bool, True where the mark is black; first row on top."""
        rim = "#" * MARK_CELLS
        rows = (rim, *(f"#{row}#" for row in self.inside), rim)
        return np.array([[cell == "#" for cell in row] for row in rows])


LARGE_MM, LARGE_CELL_MM = 40.0, 3.6
"""The mark's corners end 0.9 of a square inside the edge: white enough to stand out on dark skin."""
SMALL_MM, SMALL_CELL_MM = 32.0, 2.9
"""For babies: a newborn's breastbone is 48 mm long, and both stickers must lie on its ends without touching."""
SMALL_UNTIL_YEARS = 1.0
"""At one year the breastbone is 63-66 mm long, enough for two large ones."""

STICKERS: tuple[Sticker, ...] = (
    Sticker("suprasternal_notch", "large", 33, LARGE_MM, LARGE_CELL_MM, ("..#..", "#...#", "..###", "...#.", ".####")),
    Sticker("xiphisternum", "large", 25, LARGE_MM, LARGE_CELL_MM, ("#.###", "#...#", "###..", "...#.", "##.##")),
    Sticker("suprasternal_notch", "small", 21, SMALL_MM, SMALL_CELL_MM, ("..#.#", "###.#", "#..#.", ".....", "...##")),
    Sticker("xiphisternum", "small", 8, SMALL_MM, SMALL_CELL_MM, ("..#..", ".#.#.", "#.###", ".#...", "##...")),
)


def white_between(sticker: Sticker) -> float:
    """Smallest width of white between the mark's corners and the sticker's edge, in squares."""
    return float((sticker.diameter_mm - np.sqrt(2.0) * sticker.mark_mm) / 2 / sticker.cell_mm)


@dataclass(frozen=True)
class SeenSticker:
    """A sticker on a scan. position, normal: (3,), mm; scale: measured over printed size; squares_off: 0 to 2."""

    sticker: Sticker
    position: np.ndarray
    normal: np.ndarray
    scale: float
    squares_off: int
    is_mirrored: bool


@dataclass(frozen=True)
class StickerProof:
    """What stickers proved about a scan that is used: it is not mirrored, and how its size compares.

    found: the bones they lay on; scale: measured over printed size, 1 when both are true.
    """

    found: tuple[str, ...]
    scale: float
