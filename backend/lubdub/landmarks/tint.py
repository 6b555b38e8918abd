"""The colours of a scan's skin as places spread over it, a few millimetres apart, whatever the file's own grain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.colour import Colouring, Tint
from lubdub.geometry.surface import Surface
from lubdub.results import CleanScan


@dataclass(frozen=True)
class TintSettings:
    """How closely colours are read. apart, margin: shares of the cleaned skin's diagonal."""

    apart: float = 0.006
    """4 mm on an adult, along a triangle's longest side: nearer to each other across it."""
    margin: float = 0.02
    most_parts: int = 8
    """Of a triangle's side."""
    most_places: int = 120_000
    """Beyond it places are left out evenly."""


SETTINGS = TintSettings()


def tint_of(surface: Surface, colouring: Colouring, scan: CleanScan) -> Tint:
    """The colours on and around a cleaned scan. surface: as in the file, in its coordinates."""
    skin = scan.body_from_file.inverse().apply(scan.points)
    span = float(np.linalg.norm(np.ptp(skin, axis=0)))
    margin = SETTINGS.margin * span
    inside = ((surface.vertices > skin.min(axis=0) - margin) & (surface.vertices < skin.max(axis=0) + margin)).all(
        axis=1
    )
    if surface.is_cloud:
        return _of_points(surface, colouring, inside)
    chosen, weights = _spread(
        surface, _coloured(colouring, inside[surface.triangles].any(axis=1)), SETTINGS.apart * span
    )
    points = np.einsum("kc,kcd->kd", weights, surface.vertices[surface.triangles[chosen]])
    return Tint(points, colouring.at(surface.triangles, chosen, weights))


def _of_points(surface: Surface, colouring: Colouring, inside: np.ndarray) -> Tint:
    if colouring.vertices is None:
        return Tint(np.zeros((0, 3)), np.zeros((0, 3), np.float32))
    kept = _thinned(np.flatnonzero(inside), int(inside.sum()))
    return Tint(surface.vertices[kept], colouring.vertices[kept].astype(np.float32))


def _coloured(colouring: Colouring, wanted: np.ndarray) -> np.ndarray:
    """(m,) bool: the wanted triangles whose colour is known."""
    if colouring.vertices is not None:
        return wanted
    return np.zeros_like(wanted) if colouring.picture is None else np.asarray(wanted & (colouring.picture >= 0))


def _spread(surface: Surface, wanted: np.ndarray, apart: float) -> tuple[np.ndarray, np.ndarray]:
    """(k,) triangles and (k, 3) barycentric weights of places on them, about as far apart everywhere."""
    corners = surface.vertices[surface.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.ceil(np.minimum(sides / apart, SETTINGS.most_parts)).astype(int)
    parts = np.maximum(parts, 1)
    total = int((parts[wanted] ** 2).sum())
    chosen, weights = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for count in range(1, SETTINGS.most_parts + 1):
        places = _within_triangle(count)
        mine = _thinned(np.flatnonzero(wanted & (parts == count)), total)
        chosen.append(np.repeat(mine, len(places)))
        weights.append(np.tile(places, (len(mine), 1)))
    return np.concatenate(chosen), np.concatenate(weights)


def _thinned(these: np.ndarray, total: int) -> np.ndarray:
    return these[:: max(1, -(-total // SETTINGS.most_places))]


def _within_triangle(count: int) -> np.ndarray:
    """(count^2, 3) barycentric middles of the small triangles into which a triangle falls."""
    upright = [(i, j) for i in range(count) for j in range(count - i)]
    turned = [(i, j) for i in range(count - 1) for j in range(count - 1 - i)]
    middles = np.array([(i + 1 / 3, j + 1 / 3) for i, j in upright] + [(i + 2 / 3, j + 2 / 3) for i, j in turned])
    return np.column_stack([count - middles.sum(axis=1), middles]) / count
