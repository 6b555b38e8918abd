"""Finds the printed stickers on a coloured scan: which bone each lies on, its true size, and whether it is mirrored.

First the skin is looked at from a few sides and a marker detector is run on each picture and on its mirror image. What
it finds is then looked at once more from straight above, closely: only what is read there again, the same way round,
flat and round enough counts. Bare skin never got that far (see `./lubdub benchmark stickers`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation, map_coordinates

from lubdub.geometry.colour import Colouring
from lubdub.geometry.stickers import BONES, FAMILY, MARK_CELLS, STICKERS, SeenSticker, Sticker
from lubdub.geometry.surface import Surface, unit
from lubdub.landmarks.sticker_views import ColouredSkin, Picture, View, towards
from lubdub.results import CleanScan


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
    unflat: float = 0.1
    """Root mean square distance from its plane, in diameters."""
    least_skin: float = 0.7
    """Share of the sticker's disc under which there is scanned skin."""
    least_slope: float = 0.3
    """Cosine between the skin and the line of sight."""
    apart: float = 0.5
    """Two finds closer than this, in diameters, are one."""


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


def find_stickers(surface: Surface, colouring: Colouring, scan: CleanScan) -> tuple[SeenSticker, ...]:
    """The stickers on a scan. surface: as in the file, scaled into the frame of `scan`.

    It stops looking as soon as it has seen one for each bone.

    Nothing is taken from the unit but a first guess at how close to look: `scale` tells when it is wrong.
    """
    skin = ColouredSkin(surface, colouring, scan.points, scan.normals)
    seen: list[SeenSticker] = []
    for view in _views(scan.points, scan.normals):
        picture = skin.seen(view)
        for find in marks_in(picture.grey):
            sure = _looked_closely(skin, view, picture, find)
            if sure is not None and not any(_is_same(sure, other) for other in seen):
                seen.append(sure)
        if len({one.sticker.bone for one in seen}) == len(BONES):
            break
    return tuple(seen)


def _is_same(one: SeenSticker, other: SeenSticker) -> bool:
    near = SETTINGS.apart * one.sticker.diameter_mm * one.scale
    alike = one.sticker == other.sticker and one.is_mirrored == other.is_mirrored
    return alike and float(np.linalg.norm(one.position - other.position)) < near


def _views(points: np.ndarray, normals: np.ndarray) -> Iterator[View]:
    """From the front first, then from wherever most of the skin not yet seen faces; each shows that skin alone."""
    span = float(np.ptp(points, axis=0).max())
    least, most = SETTINGS.span_pixels
    pixel = max(min(SETTINGS.pixel_mm, span / least), span / most)
    margin = SETTINGS.margin_mm * pixel / SETTINGS.pixel_mm
    unseen = np.ones(len(points), bool)
    for _ in range(SETTINGS.most_views):
        if unseen.mean() < SETTINGS.unseen_share:
            return
        outward = _most_common(normals[unseen])
        shown = unseen & (normals @ outward > SETTINGS.facing)
        unseen &= ~shown
        if shown.any():
            yield _window(points[shown], outward, pixel, margin)


def _most_common(normals: np.ndarray) -> np.ndarray:
    """(3,) the direction that most of these normals are near to: their mean, drawn to the thickest of them."""
    direction = unit(normals.mean(axis=0))
    counts = normals[:: max(len(normals) // 300, 1)]
    candidates = np.concatenate([direction[None], counts])
    return np.asarray(
        candidates[(candidates @ normals[:: max(len(normals) // 2000, 1)].T > SETTINGS.facing).sum(axis=1).argmax()]
    )


def _window(points: np.ndarray, outward: np.ndarray, pixel: float, margin: float) -> View:
    """A window on these points, in which only the places near them are looked at."""
    axes = towards(outward)
    places = points @ axes.T
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    columns, rows = (int(np.ceil((high[one] - low[one]) / pixel)) for one in (0, 1))
    block = max(int(margin / pixel), 1)
    across, down = ((places[:, one] - low[one]) // (block * pixel) for one in (0, 1))
    coarse = np.zeros((rows // block + 1, columns // block + 1), np.int64)
    np.add.at(coarse, (down.astype(int), across.astype(int)), 1)
    covered = coarse > SETTINGS.crowd * np.median(coarse[coarse > 0])
    wanted = binary_dilation(covered, np.ones((3, 3))).repeat(block, axis=0).repeat(block, axis=1)[:rows, :columns]
    return View((low + high) / 2 @ axes, axes, pixel, columns, rows, wanted)


@lru_cache(maxsize=1)
def _detectors() -> tuple[Any, ...]:
    from pyapriltags import Detector  # loads a library of its own, which scans without colour need not pay for

    return tuple(Detector(families=FAMILY, quad_decimate=1.0, quad_sigma=blur) for blur in SETTINGS.blurs)


def marks_in(grey: np.ndarray) -> list[Find]:
    """Our marks in a picture (rows, columns) uint8 and in its mirror image, each once."""
    marks: list[Find] = []
    for is_mirrored in (False, True):
        shown = np.ascontiguousarray(grey[:, ::-1] if is_mirrored else grey)
        for detector in _detectors():
            for found in detector.detect(shown):
                mark = _ours(found, grey.shape[1] if is_mirrored else None)
                if mark is not None and not any(_overlap(mark, other) for other in marks):
                    marks.append(mark)
    return marks


def _ours(found: Any, mirrored_width: int | None) -> Find | None:
    """What the detector found, when it is one of our marks and surely read."""
    sticker = next((one for one in STICKERS if one.number == found.tag_id), None)
    if sticker is None or found.hamming > SETTINGS.squares_off or found.decision_margin < SETTINGS.least_margin:
        return None
    corners = np.asarray(found.corners, np.float64)
    if mirrored_width is not None:
        corners = np.stack([mirrored_width - corners[:, 0], corners[:, 1]], axis=1)
    return Find(sticker, corners, int(found.hamming), mirrored_width is not None)


def _overlap(one: Find, other: Find) -> bool:
    alike = one.sticker == other.sticker and one.is_mirrored == other.is_mirrored
    apart = np.linalg.norm(one.corners.mean(axis=0) - other.corners.mean(axis=0))
    return alike and bool(apart < SETTINGS.apart * _side(one.corners))


def _looked_closely(skin: ColouredSkin, view: View, picture: Picture, find: Find) -> SeenSticker | None:
    """The same mark from straight above, measured; None when it is not read there again."""
    diameter = _side(find.corners) * view.pixel / find.sticker.mark_mm * find.sticker.diameter_mm
    plane = _plane(view, picture, find, diameter)
    if plane is None:
        return None
    middle, outward = plane
    pixel = diameter / find.sticker.diameter_mm * find.sticker.cell_mm / SETTINGS.close_pixels
    pixels = int(np.ceil(SETTINGS.close_window * diameter / pixel))
    close = View(middle, towards(outward), pixel, pixels, pixels)
    seen = skin.seen(close)
    for again in marks_in(seen.grey):
        if again.sticker == find.sticker and again.is_mirrored == find.is_mirrored:
            return _measured(close, seen, again)
    return None


def _measured(view: View, picture: Picture, find: Find) -> SeenSticker | None:
    """Its place, size and slope, None when it has no shape that a printed sticker can have."""
    sides = np.linalg.norm(find.corners - np.roll(find.corners, 1, axis=0), axis=1)
    if sides.max() > (1 + SETTINGS.uneven_sides) * sides.min():
        return None
    scale = _side(find.corners) * view.pixel / find.sticker.mark_mm
    diameter = find.sticker.diameter_mm * scale
    plane = _plane(view, picture, find, diameter)
    if plane is None or _likeness(picture.grey, find) < SETTINGS.likeness:
        return None
    middle, outward = plane
    return SeenSticker(find.sticker, middle, outward, scale, find.squares_off, find.is_mirrored)


def _likeness(grey: np.ndarray, find: Find) -> float:
    """Correlation, -1 to 1, between the picture and what was printed, over the whole disc."""
    sticker = find.sticker
    radius = sticker.diameter_mm / 2 / sticker.cell_mm - _CUT_CELLS
    steps = np.arange(-radius, radius, 1 / _SAMPLES_PER_CELL)
    x, y = (one.ravel() for one in np.meshgrid(steps, steps))
    x, y = x[np.hypot(x, y) < radius], y[np.hypot(x, y) < radius]
    column, row = (np.floor(one + MARK_CELLS / 2).astype(int) for one in (x, y))
    inside = (np.minimum(row, column) >= 0) & (np.maximum(row, column) < MARK_CELLS)
    last = MARK_CELLS - 1
    printed = ~(inside & sticker.cells()[np.clip(row, 0, last), np.clip(column, 0, last)])
    places = _on_picture(find.corners, np.stack([x, y], axis=1) * 2 / MARK_CELLS)
    seen = map_coordinates(grey.astype(np.float32), places[:, ::-1].T - 0.5, order=1, mode="nearest")
    return float(np.corrcoef(printed.astype(float), seen)[0, 1]) if seen.std() > 0 else 0.0


def _on_picture(corners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(k, 2) pixels of places (k, 2) on the mark, whose corners lie at -1 and 1, x right and y down."""
    rows, values = [], []
    for (u, v), (x, y) in zip(_CORNERS, corners, strict=True):
        rows += [[u, v, 1, 0, 0, 0, -u * x, -v * x], [0, 0, 0, u, v, 1, -u * y, -v * y]]
        values += [x, y]
    map_ = np.append(np.linalg.solve(np.array(rows), np.array(values)), 1.0).reshape(3, 3)
    moved = np.column_stack([places, np.ones(len(places))]) @ map_.T
    return np.asarray(moved[:, :2] / moved[:, 2:])


def _side(corners: np.ndarray) -> float:
    """Side of the square with the same area as the four corners (4, 2) enclose, in pixels."""
    x, y = corners.T
    return float(np.sqrt(0.5 * abs(x @ np.roll(y, 1) - y @ np.roll(x, 1))))


def _plane(view: View, picture: Picture, find: Find, diameter: float) -> tuple[np.ndarray, np.ndarray] | None:
    """The sticker's middle on the skin (3,) and its outward direction (3,); None when the skin there is not flat.

    diameter: mm.
    """
    middle = _crossing(find.corners)
    rows, columns = np.ogrid[: view.rows, : view.columns]
    inside = np.hypot(columns + 0.5 - middle[0], rows + 0.5 - middle[1]) * view.pixel < diameter / 2
    points = picture.points[inside]
    points = points[np.isfinite(points[:, 0])]
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


def _crossing(corners: np.ndarray) -> np.ndarray:
    """(2,) where the diagonals of four corners (4, 2) meet: the mark's middle, however it is tilted."""
    a, b, c, d = corners
    share = np.linalg.solve(np.stack([c - a, b - d], axis=1), b - a)[0]
    return np.asarray(a + share * (c - a))
