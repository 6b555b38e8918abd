"""Finds the second sticker when the first was read: a seam of the texture may run through it, or it is blurred.

The first one has said how large it is, which print it must be and whether the scan is mirrored. So the spots of most
contrast are compared with that one print as a whole, at any turn: a picture cut in two still looks most like itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from lubdub.geometry.stickers import MARK_CELLS, STICKERS, SeenSticker, Sticker
from lubdub.landmarks.sticker_prints import SETTINGS, Find, likenesses, plane_of, printed, square, turned
from lubdub.landmarks.sticker_views import ColouredSkin, Picture, View, towards

_WIDE, _NEAR = np.arange(-2.0, 2.1), np.arange(-0.5, 0.51, 0.25)
"""Shifts tried, in squares of the mark: first around the spot of most contrast, then around the best of those."""
_TURNS, _SMALL_TURNS = np.deg2rad(np.arange(0.0, 360.0, 10.0)), np.deg2rad(np.arange(-6.0, 6.1, 3.0))
_SIZES = np.array([-0.04, 0.0, 0.04])


def other_one(skin: ColouredSkin, views: Iterable[View], known: SeenSticker) -> SeenSticker | None:
    """The sticker of the same size on the other bone, None when nothing looks enough like it."""
    if known.is_mirrored:
        return None  # the scan is refused, wherever the other one lies
    sticker = next(one for one in STICKERS if one.size == known.sticker.size and one.bone != known.sticker.bone)
    diameter = sticker.diameter_mm * known.scale
    for view in views:
        picture = skin.seen(view)
        for middle in _spots(picture, view, known.position, diameter):
            found = _at(skin, view, picture, middle, sticker, known)
            if found is not None:
                return found
    return None


def _spots(picture: Picture, view: View, known: np.ndarray, diameter: float) -> Iterator[np.ndarray]:
    """(2,) x, y pixels where there is most contrast within a sticker's width, the greatest first."""
    width = max(round(0.6 * diameter / view.pixel), 3)
    grey = picture.grey.astype(np.float32)
    spread = uniform_filter(grey**2, width) - uniform_filter(grey, width) ** 2
    apart = np.linalg.norm(picture.points - known, axis=2)
    low, high = (share * diameter for share in SETTINGS.rescue_reach)
    is_skin = uniform_filter(np.isfinite(apart).astype(np.float32), width) > 0.99
    spread[~(is_skin & (apart > low) & (apart < high))] = 0.0
    peaks = np.argwhere((spread == maximum_filter(spread, width)) & (spread > 0))
    order = np.argsort(-spread[tuple(peaks.T)])[: SETTINGS.rescue_places]
    yield from peaks[order][:, ::-1] + 0.5


def _at(
    skin: ColouredSkin, view: View, picture: Picture, middle: np.ndarray, sticker: Sticker, known: SeenSticker
) -> SeenSticker | None:
    """The sticker if it lies around this place of the picture."""
    diameter = sticker.diameter_mm * known.scale
    rough = square(sticker, middle, 0.0, sticker.mark_mm * known.scale / view.pixel, False)
    plane = plane_of(view, picture, rough, diameter)
    if plane is None:
        return None
    pixel = sticker.cell_mm * known.scale / SETTINGS.close_pixels
    pixels = int(np.ceil(SETTINGS.close_window * diameter / pixel))
    close = View(plane[0], towards(plane[1]), pixel, pixels, pixels)
    seen = skin.seen(close)
    best = _most_alike(seen.grey, sticker)
    if best is None:
        return None
    place = plane_of(close, seen, best, diameter)
    return None if place is None else SeenSticker(sticker, *place, known.scale, 0, False)


def _most_alike(grey: np.ndarray, sticker: Sticker) -> Find | None:
    """The print where and how it fits a close picture best; None when it is not like it, or another is as well."""
    cell = SETTINGS.close_pixels
    start = np.array([grey.shape[1] / 2, grey.shape[0] / 2, 0.0, cell * MARK_CELLS])
    score, pose = _best(grey, sticker, start + _grid(cell * _WIDE, _TURNS, [0.0]))
    if score < SETTINGS.rescue_hopeful:
        return None
    score, pose = _best(grey, sticker, pose + _grid(cell * _NEAR, _SMALL_TURNS, start[3] * _SIZES))
    here = np.array([*pose[:2], 0.0, start[3]]) + _grid(np.zeros(1), _TURNS, [0.0])
    rivals = [(one, mirrored) for one in STICKERS for mirrored in (False, True) if one.size == sticker.size]
    rival = max(_best(grey, one, here, mirrored)[0] for one, mirrored in rivals if mirrored or one != sticker)
    is_sure = score >= SETTINGS.rescue_likeness and score - rival >= SETTINGS.rescue_lead
    return square(sticker, pose[:2], float(pose[2]), float(pose[3]), is_mirrored=False) if is_sure else None


def _grid(shifts: np.ndarray, turns: np.ndarray, sizes: Sequence[float] | np.ndarray) -> np.ndarray:
    """(k, 4) every combination of shifts across and down, turns and sizes."""
    return np.stack([one.ravel() for one in np.meshgrid(shifts, shifts, turns, sizes)], axis=1)


def _best(grey: np.ndarray, sticker: Sticker, poses: np.ndarray, is_mirrored: bool = False) -> tuple[float, np.ndarray]:
    """How like the print the picture is at the best of poses (k, 4), and that pose (4,)."""
    scores = likenesses(grey, sticker, turned(printed(sticker)[0], poses, is_mirrored))
    best = int(scores.argmax())
    return float(scores[best]), poses[best]
