"""From a place in the frontal plane to the skin in front of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.frames import Similarity
from lubdub.geometry.neighbours import SurfaceFinder
from lubdub.geometry.surface import unit
from lubdub.results import CleanScan


@dataclass(frozen=True)
class DropSettings:
    """How the skin under a place is measured."""

    radius_mm: float = 12.0
    """Half the width of skin averaged: a quarter of a chestpiece, wide enough for 5 mm phone meshes."""
    reach_mm: float = 40.0
    """How far away skin may be and still be called the skin of this place, for measuring the gap."""
    layer_mm: float = 25.0
    """Skin this far behind the frontmost is another layer (an arm, the back of a closed scan)."""


@dataclass(frozen=True)
class SkinPlace:
    """Skin in front of a place: (3,) position, (3,) outward normal, and how far off the nearest skin was."""

    position: np.ndarray
    normal: np.ndarray
    gap_mm: float


class Skin:
    """The front of a clean scan, asked from the front."""

    def __init__(self, scan: CleanScan, settings: DropSettings | None = None) -> None:
        self._settings = settings or DropSettings()
        facing = scan.normals[:, 2] > 0.1
        self._points = scan.points[facing] if facing.any() else scan.points
        self._normals = scan.normals[facing] if facing.any() else scan.normals
        self._tree = cKDTree(self._points[:, :2])

    def drop(self, place: np.ndarray) -> SkinPlace:
        """The skin on the line through place (3,) along the front-back axis."""
        gap = float(self._tree.query(place[:2])[0])
        reach = max(self._settings.radius_mm, gap * 1.5)
        near = np.asarray(self._tree.query_ball_point(place[:2], reach), dtype=np.int64)
        depth = self._points[near, 2]
        near = near[depth > depth.max() - self._settings.layer_mm]
        normal = unit(self._normals[near].mean(axis=0))
        centre = np.median(self._points[near], axis=0)
        slope = normal[:2] / max(float(normal[2]), 0.3)
        z = centre[2] - float(slope @ (place[:2] - centre[:2]))
        return SkinPlace(np.array([place[0], place[1], z]), normal, gap)


def on_file(place: SkinPlace, in_file: SurfaceFinder, body_from_file: Similarity) -> np.ndarray:
    """(3,) body frame: the place on the file's own, uncleaned surface.

    The nearest place on a mesh's triangles. A cloud has points only, each with its noise: there the smooth skin through
    them stands, which is 1.6 mm nearer to the true skin with a Kinect's and 1.2 mm with others'; but where no point is
    near it, the nearest one.
    """
    if in_file.is_cloud and place.gap_mm < DropSettings.radius_mm:
        return place.position
    nearest = in_file.nearest(body_from_file.inverse().apply(place.position), 10.0 / body_from_file.scale)
    return body_from_file.apply(nearest)
