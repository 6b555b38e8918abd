"""The four areas painted on the skin: a shape the size of a chestpiece, a letter, a number, a faint region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lubdub.geometry.surface import unit
from lubdub.report.render import Seen, mean_near
from lubdub.results import Area, AreaName

Colour = tuple[int, int, int]
Outline = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Signed distance to an outline of about radius 1 at (across, along): negative inside."""

EVEN_MM = 5.0
"""Reach over which the skin under a mark is evened out."""

WHITE: Colour = (255, 255, 255)
INK: Colour = (31, 42, 46)


def circle(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A ring."""
    return np.asarray(np.hypot(u, v) - 1)


def rounded_square(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A square with round corners, its sides 0.9 from the middle."""
    side, corner = 0.9, 0.3
    a, b = np.abs(u) - (side - corner), np.abs(v) - (side - corner)
    outside = np.hypot(np.clip(a, 0, None), np.clip(b, 0, None))
    return np.asarray(outside + np.clip(np.maximum(a, b), None, 0) - corner)


def triangle(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A triangle with its tip up."""
    slope = np.sqrt(3) / 2
    return np.asarray(np.maximum(-v, np.abs(u) * slope + v / 2) - 0.72)


def diamond(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A square on its tip."""
    return np.asarray((np.abs(u) + np.abs(v)) / np.sqrt(2) - 0.86)


@dataclass(frozen=True)
class AreaStyle:
    """How one area looks: told apart by number, letter and shape, then by colour (Okabe and Ito's set)."""

    number: int
    letter: str
    word: str
    outline: Outline
    colour: Colour
    ink: Colour


STYLES: dict[AreaName, AreaStyle] = {
    "aortic": AreaStyle(1, "A", "Aortic", circle, (0, 114, 178), WHITE),
    "pulmonary": AreaStyle(2, "P", "Pulmonary", rounded_square, (240, 176, 32), INK),
    "tricuspid": AreaStyle(3, "T", "Tricuspid", triangle, (0, 158, 115), INK),
    "mitral": AreaStyle(4, "M", "Mitral", diamond, (204, 121, 167), INK),
}


def paint_area(picture: np.ndarray, seen: Seen, area: Area, style: AreaStyle, size_mm: float) -> None:
    """Paint one area into picture (h, w, 3) of 0..255, as if drawn on the skin itself.

    size_mm: the radius of the shape. The region of `area.radius_mm` is a faint disc with a thin edge.
    """
    window = _window(seen, area.position, max(area.radius_mm, 1.7 * size_mm))
    picture = picture[window]
    towards = unit(area.normal)
    up = unit(np.array([0.0, 1.0, 0.0]) - towards[1] * towards)
    away = _evened(seen, window) - area.position
    across, along = away @ np.cross(up, towards), away @ up
    pixel = seen.view.mm_per_pixel
    region = np.hypot(across, along) - area.radius_mm
    shape = style.outline(across / size_mm, along / size_mm) * size_mm
    stroke = 0.13 * size_mm
    _lay(picture, style.colour, 0.20 * _inside(region, pixel))
    _lay(picture, style.colour, 0.85 * _inside(np.abs(region) - 0.05 * size_mm, pixel))
    _lay(picture, WHITE, 0.55 * _inside(shape, pixel))
    _lay(picture, WHITE, _inside(np.abs(shape) - stroke - 0.07 * size_mm, pixel))
    _lay(picture, style.colour, _inside(np.abs(shape) - stroke, pixel))


def _evened(seen: Seen, window: tuple[slice, slice]) -> np.ndarray:
    """(h, w, 3) the skin in a window without the scan's noise, which would fray every line drawn on it."""
    points, met = seen.points[window], seen.met[window]
    towards = seen.view.axes[2]
    height = np.where(met, points @ towards, 0.0)
    even = mean_near(height[..., None], met, EVEN_MM / seen.view.mm_per_pixel)[..., 0]
    return np.asarray(points + (even - height)[..., None] * towards)


def _window(seen: Seen, place: np.ndarray, reach_mm: float) -> tuple[slice, slice]:
    """The rows and columns of pixels that may show skin within reach of a place."""
    column, row = seen.view.pixels_of(place)[0]
    reach = 1.1 * reach_mm / seen.view.mm_per_pixel + 2
    return _slice(row, reach), _slice(column, reach)


def _slice(middle: float, reach: float) -> slice:
    return slice(max(0, int(middle - reach)), max(0, int(middle + reach) + 1))


def _inside(distance: np.ndarray, pixel_mm: float) -> np.ndarray:
    """1 inside, 0 outside, and smooth over a pixel between; 0 where there is no skin."""
    return np.nan_to_num(np.clip(0.5 - distance / pixel_mm, 0, 1), nan=0.0)


def _lay(picture: np.ndarray, colour: Colour, cover: np.ndarray) -> None:
    picture += cover[..., None] * (np.array(colour, np.float64) - picture)
