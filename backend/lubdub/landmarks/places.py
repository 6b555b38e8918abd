"""Where navel and nipples lie: the fitted body's places as a prior, the look of the skin as evidence, a posterior.

The look is the skin's relief, and its colours where the scan has any. A landmark need not show by its colour; where it
does, it is known more closely than by its shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve

from lubdub.geometry.signs import Sign, Signs
from lubdub.landmarks.patches import told
from lubdub.landmarks.relief import CELL, Skin, Window, grain, relief, window_at
from lubdub.landmarks.signs import MARGIN, evidence


@dataclass(frozen=True)
class Prior:
    """Where a landmark lies against the fitted body's, in units of length. shift, spread: (outwards, up) mean and one
    standard deviation; search: cells to either side that are looked at; untold: one standard deviation, each way, of
    what no sign tells; patches: radii that it has by colour; stray: share of fitted bodies that have it STRAYS times
    as far off along the body."""

    shift: tuple[float, float]
    spread: tuple[float, float]
    search: tuple[int, int]
    untold: float
    patches: tuple[float, ...]
    stray: float = 0.0


STRAYS = 3.0


@dataclass(frozen=True)
class PlaceSettings:
    """How much the evidence is believed.

    On 190 simulated scans (`./lubdub benchmark cohort --seed 1 --size 200`) navel and nipples were 8 mm off (median);
    95 in 100 within 40 and 27. Worst are babies' navels, whose fitted bodies are wrong. On a modelled woman of another
    origin, whose breasts hang low, the navel is 11 mm off, and the nipples 28, where the fitted body had them 36.
    With colours, on 55 painted people: see `./lubdub benchmark colour`.
    """

    belief: float = 0.7
    """Real evidence is worth less than what was learned on scans whose bodies were placed exactly."""
    apart: float = 0.03
    """How much further one nipple may have moved than the other, in units of length: they share the rest."""
    coloured: float = 0.85
    """Chance that a landmark shows by its colour, where there is any."""
    colour_untold: float = 0.016
    """One standard deviation, each way, between the middle of a coloured patch and the landmark."""
    surprise: float = 0.03
    """Chance that none of this holds and the landmark lies anywhere the prior allows."""


NAVEL = Prior(
    shift=(0.0, 0.0), spread=(0.02, 0.16), search=(6, 50), untold=0.02, patches=(0.04, 0.06, 0.085), stray=0.1
)
"""Of babies most are fitted with the navel far too high."""
NIPPLE = Prior(shift=(0.0, 0.0), spread=(0.08, 0.12), search=(20, 25), untold=0.05, patches=(0.06, 0.085, 0.12, 0.17))
"""Of 94 simulated people nobody marked, the nipples lay 0.06 across and 0.125 along the body from the fitted body's."""
PLACES = PlaceSettings()


@dataclass(frozen=True)
class Found:
    """Where a landmark most likely lies: (3,) on the skin; doubt_mm: root mean square distance from it."""

    position: np.ndarray
    doubt_mm: float


@dataclass(frozen=True)
class Look:
    """What the signs in a window say. odds: (rows, columns) how likely they make each place; shown: of that, the share
    that its colour has, None without colours."""

    odds: np.ndarray
    shown: np.ndarray | None


def find_navel(skin: Skin, fitted: np.ndarray, signs: Signs) -> Found:
    """The navel near where the fitted body has it, (3,)."""
    window, heights = look(skin, fitted, NAVEL, 1.0)
    # In a mirror too, so that a mirrored body has its suggestion mirrored.
    odds = np.sqrt(_odds(signs.navel, heights) * _odds(signs.navel, heights[:, ::-1])[:, ::-1])
    seen = _with_colour(skin, window, odds, NAVEL)
    return _settled(skin, window, _posterior(seen, _prior(NAVEL), NAVEL))


def find_nipples(skin: Skin, left: np.ndarray, right: np.ndarray, signs: Signs) -> tuple[Found, Found]:
    """Both nipples near where the fitted body has them, (3,) each. What one shows counts for the other too."""
    windows, seen = [], []
    for fitted, side in ((left, 1.0), (right, -1.0)):
        window, heights = look(skin, fitted, NIPPLE, side)
        windows.append(window)
        seen.append(_with_colour(skin, window, _odds(signs.nipple, heights), NIPPLE))
    prior = _prior(NIPPLE)
    heard = [_loosened(prior * _loosened(other.odds)) for other in seen[::-1]]
    one, other = (
        _settled(skin, window, _posterior(own, from_other, NIPPLE))
        for window, own, from_other in zip(windows, seen, heard, strict=True)
    )
    return one, other


def look(skin: Skin, place: np.ndarray, prior: Prior, side: float) -> tuple[Window, np.ndarray]:
    """The window around where the prior expects a landmark that the fitted body has at a place (3,), and its map.

    side: 1 where outwards is the patient's left, -1 where it is right.
    """
    across, along = skin.size * np.array(prior.shift)
    expected = place + np.array([side * across, along, 0.0])
    window = window_at(skin, expected, side, (prior.search[0] + MARGIN, prior.search[1] + MARGIN))
    return window, relief(skin, window)


def _prior(prior: Prior) -> np.ndarray:
    """(rows, columns) chance of each place before anybody looked."""
    across, along = (
        CELL * np.arange(-cells, cells + 1) / spread for cells, spread in zip(prior.search, prior.spread, strict=True)
    )
    usual, astray = (np.exp(-0.5 * (along / reach) ** 2) for reach in (1.0, STRAYS))
    up = (1 - prior.stray) * usual / usual.sum() + prior.stray * astray / astray.sum()
    chances = up[:, None] * np.exp(-0.5 * across[None] ** 2)
    return np.asarray(chances / chances.sum())


def _odds(sign: Sign, heights: np.ndarray) -> np.ndarray:
    """(rows, columns) how much more likely the map makes each place, 1 at most."""
    logs = PLACES.belief * evidence(sign, heights, grain(heights))
    return np.asarray(np.exp(logs - logs.max()))


def _with_colour(skin: Skin, window: Window, odds: np.ndarray, prior: Prior) -> Look:
    """What the relief says, and what the colours say of it where there are any."""
    likelier = told(skin, window, prior.patches)
    if likelier is None:
        return Look(odds, None)
    shown = PLACES.coloured * likelier
    either = shown + (1 - PLACES.coloured)
    return Look(odds * either, shown / either)


def _loosened(chances: np.ndarray) -> np.ndarray:
    """What chances of one nipple say of the other."""
    return np.asarray(gaussian_filter(chances, PLACES.apart / CELL, mode="constant"))


def _posterior(seen: Look, chances: np.ndarray, prior: Prior) -> np.ndarray:
    """(rows, columns) chance of each place. chances: without what the signs at the place itself say."""
    sure = seen.odds * chances
    mixed = (1 - PLACES.surprise) * sure / sure.sum() + PLACES.surprise * chances / chances.sum()
    if seen.shown is None:
        blurred = gaussian_filter(mixed, prior.untold / CELL, mode="constant")
    else:
        by_colour = (1 - PLACES.surprise) * sure / sure.sum() * seen.shown
        blurred = gaussian_filter(mixed - by_colour, prior.untold / CELL, mode="constant")
        blurred += gaussian_filter(by_colour, PLACES.colour_untold / CELL, mode="constant")
    return np.asarray(blurred / blurred.sum())


def _settled(skin: Skin, window: Window, chances: np.ndarray) -> Found:
    """The place with the least expected distance from the landmark, brought to the skin."""
    across, along = (CELL * (np.arange(side) - side // 2) for side in chances.shape[::-1])
    place = _middle(chances, across, along)
    squared = (across[None] - place[0]) ** 2 + (along[:, None] - place[1]) ** 2
    return Found(skin.under(window, place), window.size * float(np.sqrt((chances * squared).sum())))


def _middle(chances: np.ndarray, across: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(2,) outwards and up: of all cells the one nearest to the landmark on average, then refined between cells.

    Of two likely places it takes one; a mean would lie between them, where the landmark is not.
    """
    rows, columns = chances.shape
    offsets = (CELL * np.arange(1 - side, side) for side in (columns, rows))
    expected = fftconvolve(np.hypot(*np.meshgrid(*offsets)), chances, mode="valid")
    row, column = np.unravel_index(expected.argmin(), expected.shape)
    squared = (across[None] - across[column]) ** 2 + (along[:, None] - along[row]) ** 2
    near = chances * np.exp(-0.5 * squared / (2 * CELL) ** 2)
    return np.array([near.sum(axis=0) @ across, near.sum(axis=1) @ along]) / near.sum()
