"""Round patches that are darker or redder than the skin all around: how an areola, or a navel, shows by colour.

A place is the middle of one when the halves of a disc are darker than each two opposite eighths of the ring around it.
So slopes of light cancel, and the edge of a shadow, a seam between photographs, a necklace or a line of hair is none;
a mole is little of a disc. Everything is measured against how much this very skin varies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter, maximum_filter
from scipy.spatial import cKDTree

from lubdub.geometry.colour import Tint
from lubdub.landmarks.relief import CELL, FACING, Skin, Window
from lubdub.landmarks.signs import MARGIN


@dataclass(frozen=True)
class PatchSettings:
    """What counts as colour, and how much a patch tells.

    The weights were chosen on 60 painted people of seed 901; `./lubdub benchmark colour` reports others.
    """

    near: float = 0.15
    """Coloured places farther than this from the trunk's skin, in units of length, belong to an arm or a bed."""
    dark: float = 12.0
    bright: float = 250.0
    """Colours, of 255, beyond which a camera shows no difference any more."""
    greyish: float = 6.0
    """When red and green differ by less almost everywhere, the scan has no colours of its own."""
    known: float = 0.5
    """Share of a disc and its ring whose colour must be known."""
    darkness_floor: float = 0.006
    redness_floor: float = 0.003
    """No skin is taken to vary less, in logarithms: pictures are packed and noisy."""
    darkness_tells: float = 0.65
    redness_tells: float = 0.65
    """Logarithm of the chances for each spread of the skin's own that a patch stands out by."""
    saturated: float = 14.0
    """Standing out by more than about so many spreads proves no more: ink and paint do."""
    doubtful: float = 1.8
    """What plain skin reaches somewhere anyway."""
    least: float = -3.0
    most: float = 6.0
    """Logarithms of how much less and more likely a place becomes, at the outside."""


SETTINGS = PatchSettings()
_BLUR, _FILL, _PEAK = 0.7, 6.0, 5  # cells
_DISC, _RING, _RING_CELLS = 0.8, 1.35, 3.0  # times the radius; how wide the ring is
_QUARTERS, _EIGHTHS = 4, 8


def told(skin: Skin, window: Window, radii: Sequence[float]) -> np.ndarray | None:
    """(rows - 2 MARGIN, columns - 2 MARGIN) how much likelier the colours in a window are if a patch of one of these
    radii has its middle in a cell, against none anywhere.

    None where colours say nothing: missing, grey, over- or underexposed.
    """
    if skin.tint is None:
        return None
    chosen = _in_window(skin, skin.tint, window)
    points, colours = skin.tint.points[chosen], skin.tint.colours[chosen]
    if not len(chosen) or np.percentile(np.abs(colours[:, 0] - colours[:, 1]), 95) < SETTINGS.greyish:
        return None
    maps = _shades(window.seen(points), colours, window)
    best = np.max([_standing_out(maps, radius / CELL) for radius in radii], axis=0)
    return np.asarray(np.exp(_limited(best - SETTINGS.doubtful)))


def _limited(logs: np.ndarray) -> np.ndarray:
    """Every peak lowered to the most that colours may tell, with its slopes as they are: its place stays clear."""
    peaks = maximum_filter(logs, 2 * _PEAK + 1)
    return np.asarray(np.maximum(logs - np.maximum(peaks - SETTINGS.most, 0.0), SETTINGS.least))


def _shades(seen: np.ndarray, colours: np.ndarray, window: Window) -> np.ndarray:
    """(3, rows, columns) of a window's cells: darkness and redness, both logarithms, and whether they are known."""
    red, green = (np.log(colours[:, channel] + SETTINGS.dark) for channel in (0, 1))
    columns, rows = (2 * cells + 1 for cells in window.half)
    column, row = (np.rint(seen[:, axis] / CELL).astype(int) + window.half[axis] for axis in (0, 1))
    cells = row * columns + column
    count = np.bincount(cells, minlength=rows * columns).reshape(rows, columns)
    share = gaussian_filter((count > 0).astype(float), _BLUR, mode="constant")
    known = share > 0.25
    maps = []
    for shade in (-green, red - green):
        mean = np.bincount(cells, shade, rows * columns).reshape(rows, columns) / np.maximum(count, 1)
        maps.append(_filled(gaussian_filter(mean, _BLUR, mode="constant") / np.maximum(share, 1e-9), known))
    return np.stack([*maps, known.astype(float)])


def _in_window(skin: Skin, tint: Tint, window: Window) -> np.ndarray:
    """(k,) which coloured places lie in a window and on skin that faces it."""
    reach = np.array([*(CELL * (np.array(window.half) + 0.5)), 1.0])
    seen, facing = window.seen(tint.points), window.seen(skin.points[skin.normals @ window.axes[2] > FACING])
    chosen, around = np.flatnonzero(_within(seen, reach)), facing[_within(facing, reach + SETTINGS.near)]
    brightest = tint.colours[chosen].max(axis=1)
    chosen = chosen[(brightest < SETTINGS.bright) & (brightest > SETTINGS.dark)]
    if not len(chosen) or not len(around):
        return chosen[:0]
    return chosen[np.isfinite(cKDTree(around).query(seen[chosen], distance_upper_bound=SETTINGS.near)[0])]


def _within(places: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """(k,) which of places (k, 3) lie no farther than reach (3,) from the middle, each way."""
    x, y, z = np.abs(places).T
    return np.asarray((x < reach[0]) & (y < reach[1]) & (z < reach[2]))


def _filled(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Where nothing is known, about what is known around."""
    share, total = (gaussian_filter(one, _FILL, mode="constant") for one in (known.astype(float), values * known))
    return np.where(known, values, total / np.maximum(share, 1e-9))


def _standing_out(maps: np.ndarray, radius: float) -> np.ndarray:
    """(rows - 2 MARGIN, columns - 2 MARGIN) by how much a patch of a radius, in cells, stands out around each cell."""
    parts = _parts(maps, radius)
    discs, rings = parts[:, :_QUARTERS], parts[:, _QUARTERS:]
    halves, opposite = _opposite(discs), _opposite(rings)
    contrast = halves.min(axis=1) - opposite.max(axis=1)
    usual = discs.mean(axis=1) - rings.mean(axis=1)
    total = np.zeros(contrast.shape[1:])
    shades = ((SETTINGS.darkness_tells, SETTINGS.darkness_floor), (SETTINGS.redness_tells, SETTINGS.redness_floor))
    for one, (tells, floor) in enumerate(shades):
        spread = 1.4826 * np.median(np.abs(usual[one] - np.median(usual[one]))) + floor
        total += tells * SETTINGS.saturated * np.tanh(contrast[one] / spread / SETTINGS.saturated)
    return np.where(parts[2].mean(axis=0) > SETTINGS.known, total, SETTINGS.least)


def _opposite(parts: np.ndarray) -> np.ndarray:
    """(maps, n / 2, ...) the means of opposite ones of n parts all around."""
    half = parts.shape[1] // 2
    return np.asarray((parts[:, :half] + parts[:, half:]) / 2)


def _parts(maps: np.ndarray, radius: float) -> np.ndarray:
    """(maps, 12, rows - 2 MARGIN, columns - 2 MARGIN) means over the quarters of a disc and the eighths of a ring."""
    rows, columns = maps.shape[1:]
    masks = _masks(radius, rows, columns)
    shape = next_fast_len(rows, real=True), next_fast_len(columns, real=True)
    means = irfft2(rfft2(maps, s=shape)[:, None] * masks, s=shape)
    return np.asarray(means[:, :, MARGIN : rows - MARGIN, MARGIN : columns - MARGIN])


@lru_cache(maxsize=16)
def _masks(radius: float, rows: int, columns: int) -> np.ndarray:
    """Transforms of the parts' masks, laid so that a product with a map's transform is the mean around each cell."""
    y, x = np.mgrid[-MARGIN : MARGIN + 1, -MARGIN : MARGIN + 1]
    distance, turn = np.hypot(x, y), np.arctan2(y, x) / (2 * np.pi)
    disc, hole, rim = (
        np.clip(edge - distance + 0.5, 0, 1) for edge in (_DISC * radius, _RING * radius, _RING * radius + _RING_CELLS)
    )
    parts = [disc * _sector(turn, one, _QUARTERS) for one in range(_QUARTERS)]
    parts += [(rim - hole) * _sector(turn, one, _EIGHTHS) for one in range(_EIGHTHS)]
    shape = next_fast_len(rows, real=True), next_fast_len(columns, real=True)
    laid = np.zeros((len(parts), *shape))
    laid[:, : len(y), : len(y)] = [part[::-1, ::-1] / part.sum() for part in parts]
    return np.asarray(rfft2(np.roll(laid, (-MARGIN, -MARGIN), axis=(1, 2))))


def _sector(turn: np.ndarray, number: int, of: int) -> np.ndarray:
    """Share of each cell in a sector; what lies on an edge is shared, so that a mirror changes nothing."""
    away = np.abs((turn - (number + 0.5) / of + 0.5) % 1.0 - 0.5) * of
    return np.clip((0.5 - away) * 1e6 + 0.5, 0.0, 1.0)
