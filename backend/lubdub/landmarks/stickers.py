"""Finds the printed stickers on a coloured scan: which bone each lies on, its true size, and whether it is mirrored.

First the skin is looked at from a few sides and a marker detector is run on each picture and on its mirror image. What
it finds is then looked at once more from straight above, closely: only what is read there again, the same way round,
flat and round enough counts. Bare skin never got that far (see `./lubdub benchmark stickers`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation

from lubdub.geometry.colour import Colouring
from lubdub.geometry.stickers import BONES, FAMILY, STICKERS, Bone, SeenSticker
from lubdub.geometry.surface import Surface, unit
from lubdub.landmarks.sticker_prints import SETTINGS, Find, likeness, plane_of, side_of
from lubdub.landmarks.sticker_prints import StickerSettings as StickerSettings
from lubdub.landmarks.sticker_rescue import other_one
from lubdub.landmarks.sticker_views import ColouredSkin, Picture, View, towards
from lubdub.results import CleanScan


def find_stickers(surface: Surface, colouring: Colouring, scan: CleanScan) -> tuple[SeenSticker, ...]:
    """The stickers on a scan. surface: as in the file, scaled into the frame of `scan`.

    It stops looking as soon as it has seen one for each bone.

    Nothing is taken from the unit but a first guess at how close to look: `scale` tells when it is wrong.
    """
    skin = ColouredSkin(surface, colouring, scan.points, scan.normals)
    seen: list[SeenSticker] = []
    for view in _views(scan.points, scan.normals):
        _add_seen(seen, skin, view)
        if len(_bones(seen)) == len(BONES):
            return tuple(seen)
    if len(_bones(seen)) == 1 and len(seen) == 1:
        views = itertools.islice(_views(scan.points, scan.normals), SETTINGS.rescue_views)
        found = other_one(skin, views, seen[0])
        seen += [] if found is None else [found]
    return tuple(seen)


def _add_seen(seen: list[SeenSticker], skin: ColouredSkin, view: View) -> None:
    """Add what this view shows and no earlier one has shown."""
    picture = skin.seen(view)
    for find in marks_in(picture.grey):
        sure = _looked_closely(skin, view, picture, find)
        if sure is not None and not any(_is_same(sure, other) for other in seen):
            seen.append(sure)


def _bones(seen: list[SeenSticker]) -> set[Bone]:
    return {one.sticker.bone for one in seen}


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
    return alike and bool(apart < SETTINGS.apart * side_of(one.corners))


def _looked_closely(skin: ColouredSkin, view: View, picture: Picture, find: Find) -> SeenSticker | None:
    """The same mark from straight above, measured; None when it is not read there again."""
    diameter = side_of(find.corners) * view.pixel / find.sticker.mark_mm * find.sticker.diameter_mm
    plane = plane_of(view, picture, find, diameter)
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
    scale = side_of(find.corners) * view.pixel / find.sticker.mark_mm
    diameter = find.sticker.diameter_mm * scale
    plane = plane_of(view, picture, find, diameter)
    if plane is None or likeness(picture.grey, find) < SETTINGS.likeness:
        return None
    middle, outward = plane
    return SeenSticker(find.sticker, middle, outward, scale, find.squares_off, find.is_mirrored)
