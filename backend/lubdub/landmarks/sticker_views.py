"""Flat pictures of a coloured scan, seen straight on from outside, in which printed stickers can be looked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.colour import Colouring
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.surface import Surface, unit

LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)
GREY = 128
_CLOUD_NEIGHBOURS = 4
_CLOUD_FACING = 0.2
_CLOUD_REACH = 2.5  # times the usual distance between points; farther away there is no skin


@dataclass(frozen=True)
class View:
    """A window through which the body is seen without perspective.

    centre: (3,) a place in front of the skin; axes: (3, 3) rows right, down, forward (into the body), right-handed;
    pixel: mm; columns, rows: of the picture; wanted: (rows, columns) bool, the part that is looked at, None for all.
    """

    centre: np.ndarray
    axes: np.ndarray
    pixel: float
    columns: int
    rows: int
    wanted: np.ndarray | None = None

    def starts(self) -> np.ndarray:
        """(k, 3) where the line of sight of each pixel that is looked at starts."""
        across = (np.arange(self.columns) + 0.5 - self.columns / 2) * self.pixel
        down = (np.arange(self.rows) + 0.5 - self.rows / 2) * self.pixel
        x, y = (one if self.wanted is None else one[self.wanted] for one in np.meshgrid(across, down))
        return np.asarray(self.centre + x.reshape(-1, 1) * self.axes[0] + y.reshape(-1, 1) * self.axes[1])


@dataclass(frozen=True)
class Picture:
    """grey: (rows, columns) uint8; points: (rows, columns, 3) mm, NaN where there is no skin."""

    grey: np.ndarray
    points: np.ndarray


def towards(outward: np.ndarray) -> np.ndarray:
    """(3, 3) a view's axes for looking at skin that faces outward (3,)."""
    forward = -unit(outward)
    right = unit(np.cross(forward, np.eye(3)[np.abs(forward).argmin()]))
    return np.stack([right, np.cross(forward, right), forward])


class ColouredSkin:
    """A coloured surface or cloud that can be looked at. Everything in mm, in one frame."""

    def __init__(self, surface: Surface, colouring: Colouring, points: np.ndarray, normals: np.ndarray) -> None:
        """surface: as in the file, in mm; points, normals: (n, 3) the cleaned skin and its outward side."""
        self._depth = float(np.linalg.norm(np.ptp(points, axis=0)))
        keep = _near(surface, points)
        self._surface, self._colouring = (surface, colouring) if keep.all() else _part(surface, colouring, keep)
        self._caster = None if self._surface.is_cloud else SkinCaster(self._surface)
        nearest = cKDTree(points).query(self._surface.vertices)[1] if surface.is_cloud else np.zeros(0, np.int64)
        self._outward = normals[nearest]

    def seen(self, view: View) -> Picture:
        """What the view shows."""
        starts = view.starts()
        if self._caster is None:
            brightness, points = self._through_cloud(view, starts)
        else:
            brightness, points = self._through_mesh(self._caster, view, starts)
        grey = np.full((view.rows, view.columns), GREY, np.uint8)
        places = np.full((view.rows, view.columns, 3), np.nan)
        where = np.ones(grey.shape, bool) if view.wanted is None else view.wanted
        grey[where], places[where] = np.clip(brightness, 0, 255), points
        return Picture(grey, places)

    def _through_mesh(self, caster: SkinCaster, view: View, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k,) brightness and (k, 3) places that lines from starts (k, 3) meet."""
        hits = caster.cast(starts - self._depth * view.axes[2], view.axes[2])
        brightness = np.full(len(starts), GREY, np.float32)
        triangles = self._surface.triangles
        brightness[hits.met] = (
            self._colouring.at(triangles, hits.triangle[hits.met], hits.weights[hits.met]) @ LUMINANCE
        )
        return brightness, hits.points

    def _through_cloud(self, view: View, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same; between points that face the view, their colours and depths are mixed by distance."""
        facing = self._outward @ view.axes[2] < -_CLOUD_FACING
        brightness, points = np.full(len(starts), GREY, np.float32), np.full((len(starts), 3), np.nan)
        if self._colouring.vertices is None or facing.sum() <= _CLOUD_NEIGHBOURS:
            return brightness, points
        places = (self._surface.vertices[facing] - view.centre) @ view.axes.T
        tree = cKDTree(places[:, :2])
        spacing = float(np.median(tree.query(places[:: len(places) // 500 + 1, :2], k=2)[0][:, 1]))
        reach = _CLOUD_REACH * spacing + view.pixel
        flat = (starts - view.centre) @ view.axes[:2].T
        distance, index = tree.query(flat, k=_CLOUD_NEIGHBOURS, distance_upper_bound=reach)
        met = np.isfinite(distance[:, 0])
        weights = np.where(np.isfinite(distance[met]), (distance[met] + 0.2 * spacing + 1e-9) ** -2.0, 0.0)
        weights /= weights.sum(axis=1, keepdims=True)
        nearest = np.minimum(index[met], len(places) - 1)
        greys = self._colouring.vertices[facing].astype(np.float32) @ LUMINANCE
        brightness[met] = (greys[nearest] * weights).sum(axis=1)
        depth = (places[nearest, 2] * weights).sum(axis=1)
        points[met] = starts[met] + depth[:, None] * view.axes[2]
        return brightness, points


def _near(surface: Surface, points: np.ndarray) -> np.ndarray:
    """(n,) bool: the vertices in the box around the cleaned skin."""
    margin = 0.02 * np.linalg.norm(np.ptp(points, axis=0))
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return np.asarray(((surface.vertices > low) & (surface.vertices < high)).all(axis=1))


def _part(surface: Surface, colouring: Colouring, keep: np.ndarray) -> tuple[Surface, Colouring]:
    whole = keep[surface.triangles].all(axis=1) if len(surface.triangles) else np.zeros(0, bool)
    return surface.kept(keep), Colouring(
        None if colouring.vertices is None else colouring.vertices[keep],
        colouring.pictures,
        None if colouring.corners is None else colouring.corners[whole],
        None if colouring.picture is None else colouring.picture[whole],
    )
