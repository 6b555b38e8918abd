"""What a printed sticker looks like in a picture: where its mark lies, how like the print it is, on what skin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import map_coordinates

from lubdub.geometry.stickers import MARK_CELLS, STICKERS, Sticker
from lubdub.landmarks.sticker_views import Picture, View


@dataclass(frozen=True)
class StickerSettings:
    """How closely it is looked and what counts as a sticker."""

    pixel_mm: float = 1.0
    """Of the first look: a square of the small mark is three pixels wide."""
    span_pixels: tuple[int, int] = (500, 1500)
    """The first look shows the skin's longest side with at least and at most so many pixels, whatever the unit says."""
    facing: float = 0.72
    """A view shows the skin that faces it within 44 degrees."""
    unseen_share: float = 0.1
    most_views: int = 6
    rescue_views: int = 2
    margin_mm: float = 25.0
    """Room around the skin in a view, and side of the blocks by which it is looked at or not."""
    crowd: float = 0.3
    """A block with fewer points than this share of the usual number is no skin that a sticker could lie on."""
    close_pixels: float = 6.0
    """Of the second look, for each of the mark's squares."""
    close_window: float = 1.9
    """Its width, in diameters."""
    blurs: tuple[float, ...] = (0.6, 0.0)
    """In pixels, before corners are sought: seams and noise want some, coarse textures none."""
    squares_off: int = 2
    """Wrongly seen squares: two marks differ in 9, and in 7 from mirrored ones. Seams of textures cost up to two."""
    likeness: float = 0.65
    """Correlation of the whole disc, white rim and all, with the print. True ones have 0.8 to 0.97."""
    least_margin: float = 12.0
    """The detector's own measure, mean difference to the threshold in grey levels; blurred true marks have 20."""
    uneven_sides: float = 0.25
    """Longest over shortest side of the mark, less one: a bent sticker has 0.1."""
    plane_share: float = 0.7
    """Of the sticker, around its middle, whose skin says how it lies: a baby's chin may hang over its edge."""
    overhang: float = 0.3
    """In diameters: what lies farther before or behind the middle is something else."""
    unflat: float = 0.15
    """Root mean square distance from its plane, in diameters."""
    least_skin: float = 0.7
    """Share of that part under which there is scanned skin."""
    least_slope: float = 0.3
    """Cosine between the skin and the line of sight."""
    apart: float = 0.5
    """Two finds closer than this, in diameters, are one."""
    rescue_places: int = 6
    """Spots of most contrast at which a second sticker is sought when one was read."""
    rescue_reach: tuple[float, float] = (1.0, 7.0)
    """Between the two stickers' middles, in diameters: 48 mm in a newborn, 200 mm and more in a tall man."""
    rescue_hopeful: float = 0.4
    rescue_likeness: float = 0.6
    """Correlation with the print; elsewhere on skin the same search came to 0.4."""
    rescue_lead: float = 0.04
    """By so much it must be more like this print than like any other, mirrored ones too."""


SETTINGS = StickerSettings()
_CORNERS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
"""Where the detector's four corners lie on the mark, x right and y down."""
_SAMPLES_PER_CELL = 3
_CUT_CELLS = 0.3  # scissors are not exact


@dataclass(frozen=True)
class Find:
    """A mark in a picture. corners: (4, 2) x, y pixels in the picture as it was before any mirroring."""

    sticker: Sticker
    corners: np.ndarray
    squares_off: int
    is_mirrored: bool


def square(sticker: Sticker, middle: np.ndarray, turn: float, side: float, is_mirrored: bool) -> Find:
    """A mark as it would lie in a picture. middle: (2,) pixels; turn: radians; side: of the mark, pixels."""
    corners = turned(np.array(_CORNERS, float), np.array([[*middle, turn, side]]), is_mirrored)[0]
    return Find(sticker, corners, 0, is_mirrored)


def turned(spots: np.ndarray, poses: np.ndarray, is_mirrored: bool) -> np.ndarray:
    """(k, n, 2) pixels of spots (n, 2) on the mark, corners at -1 and 1, for poses (k, 4): x, y, turn and side."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    across = np.stack([cosine, sine], axis=1) * (-1 if is_mirrored else 1)
    down = np.stack([-sine, cosine], axis=1)
    offset = spots[None, :, :1] * across[:, None] + spots[None, :, 1:] * down[:, None]
    return np.asarray(poses[:, None, :2] + poses[:, None, 3:] / 2 * offset)


@lru_cache(maxsize=len(STICKERS))
def printed(sticker: Sticker) -> tuple[np.ndarray, np.ndarray]:
    """Spots (n, 2) all over the disc, corners of the mark at -1 and 1, x right, y down; and (n,) 1 where white."""
    radius = sticker.diameter_mm / 2 / sticker.cell_mm - _CUT_CELLS
    steps = np.arange(-radius, radius, 1 / _SAMPLES_PER_CELL)
    x, y = (one.ravel() for one in np.meshgrid(steps, steps))
    x, y = x[np.hypot(x, y) < radius], y[np.hypot(x, y) < radius]
    column, row = (np.floor(one + MARK_CELLS / 2).astype(int) for one in (x, y))
    inside = (np.minimum(row, column) >= 0) & (np.maximum(row, column) < MARK_CELLS)
    last = MARK_CELLS - 1
    white = ~(inside & sticker.cells()[np.clip(row, 0, last), np.clip(column, 0, last)])
    return np.stack([x, y], axis=1) * 2 / MARK_CELLS, white.astype(np.float64)


def likeness(grey: np.ndarray, find: Find) -> float:
    """Correlation, -1 to 1, between the picture and what was printed, over the whole disc."""
    return float(likenesses(grey, find.sticker, on_picture(find.corners, printed(find.sticker)[0])[None])[0])


def likenesses(grey: np.ndarray, sticker: Sticker, places: np.ndarray) -> np.ndarray:
    """(k,) the same for many ways to lie. places: (k, n, 2) pixels of the spots of `printed`."""
    seen = map_coordinates(grey.astype(np.float32), places[..., ::-1].transpose(2, 0, 1) - 0.5, order=1, mode="nearest")
    white = printed(sticker)[1]
    seen, white = seen - seen.mean(axis=1, keepdims=True), white - white.mean()
    length = np.linalg.norm(seen, axis=1) * np.linalg.norm(white)
    return np.asarray(np.divide(seen @ white, length, out=np.zeros(len(seen)), where=length > 0), np.float64)


def on_picture(corners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(k, 2) pixels of places (k, 2) on the mark, whose corners lie at -1 and 1, x right and y down."""
    rows, values = [], []
    for (u, v), (x, y) in zip(_CORNERS, corners, strict=True):
        rows += [[u, v, 1, 0, 0, 0, -u * x, -v * x], [0, 0, 0, u, v, 1, -u * y, -v * y]]
        values += [x, y]
    map_ = np.append(np.linalg.solve(np.array(rows), np.array(values)), 1.0).reshape(3, 3)
    moved = np.column_stack([places, np.ones(len(places))]) @ map_.T
    return np.asarray(moved[:, :2] / moved[:, 2:])


def side_of(corners: np.ndarray) -> float:
    """Side of the square with the same area as the four corners (4, 2) enclose, in pixels."""
    x, y = corners.T
    return float(np.sqrt(0.5 * abs(x @ np.roll(y, 1) - y @ np.roll(x, 1))))


def plane_of(view: View, picture: Picture, find: Find, diameter: float) -> tuple[np.ndarray, np.ndarray] | None:
    """The sticker's middle on the skin (3,) and its outward direction (3,); None when the skin there is not flat.

    diameter: mm.
    """
    middle = crossing(find.corners)
    rows, columns = np.ogrid[: view.rows, : view.columns]
    reach = SETTINGS.plane_share * diameter / 2
    inside = np.hypot(columns + 0.5 - middle[0], rows + 0.5 - middle[1]) * view.pixel < reach
    points = picture.points[inside]
    points = points[np.isfinite(points[:, 0])]
    depth = points @ view.axes[2]
    points = points[np.abs(depth - np.median(depth)) < SETTINGS.overhang * diameter] if len(points) else points
    if len(points) < max(SETTINGS.least_skin * inside.sum(), 2 * MARK_CELLS):
        return None
    centre, forward = points.mean(axis=0), view.axes[2]
    normal = np.linalg.svd(points[:: max(len(points) // 1000, 1)] - centre, full_matrices=False)[2][2]
    if np.sqrt(np.mean(((points - centre) @ normal) ** 2)) > SETTINGS.unflat * diameter:
        return None
    slope = normal @ forward
    if abs(slope) < SETTINGS.least_slope:
        return None
    x, y = (middle - np.array([view.columns, view.rows]) / 2) * view.pixel
    start = view.centre + x * view.axes[0] + y * view.axes[1]
    return start + ((centre - start) @ normal) / slope * forward, -np.sign(slope) * normal


def crossing(corners: np.ndarray) -> np.ndarray:
    """(2,) where the diagonals of four corners (4, 2) meet: the mark's middle, however it is tilted."""
    a, b, c, d = corners
    share = np.linalg.solve(np.stack([c - a, b - d], axis=1), b - a)[0]
    return np.asarray(a + share * (c - a))
