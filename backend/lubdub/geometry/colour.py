"""What colour a surface has: at its vertices, or in pictures laid over its triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Colouring:
    """The colours of a surface with n vertices and m triangles.

    vertices: (n, 3) uint8, or None. pictures: each (h, w, 3) uint8. corners: (m, 3, 2) float32, where each corner
    of a triangle lies in its picture, as shares of width and height from the top left; beyond 0 to 1 the picture
    repeats. picture: (m,) which picture a triangle uses, -1 for none. Both are None without pictures.
    """

    vertices: np.ndarray | None = None
    pictures: tuple[np.ndarray, ...] = ()
    corners: np.ndarray | None = None
    picture: np.ndarray | None = None

    def at(self, triangles: np.ndarray, chosen: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(k, 3) float32 colours, 0 to 255, of places on triangles; grey where nothing is known.

        triangles: (m, 3) of the surface; chosen: (k,) triangle of each place; weights: (k, 3) barycentric.
        """
        colours = np.full((len(chosen), 3), 128.0, np.float32)
        if self.vertices is not None:
            corners = self.vertices[triangles[chosen]].astype(np.float32)
            colours = np.einsum("kc,kcd->kd", weights.astype(np.float32), corners)
        if self.corners is None or self.picture is None:
            return colours
        places = np.einsum("kc,kcd->kd", weights, self.corners[chosen])
        for number, picture in enumerate(self.pictures):
            mine = self.picture[chosen] == number
            colours[mine] = sampled(picture, places[mine])
        return colours


def sampled(picture: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(k, 3) float32 colours between pixels. picture: (h, w, 3); places: (k, 2) shares from the top left."""
    height, width = picture.shape[:2]
    x, y = (places[:, 0] % 1.0) * width - 0.5, (places[:, 1] % 1.0) * height - 0.5
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right_share, low_share = (x - left)[:, None], (y - top)[:, None]
    columns = [np.clip(left + step, 0, width - 1) for step in (0, 1)]
    rows = [np.clip(top + step, 0, height - 1) for step in (0, 1)]
    upper = picture[rows[0], columns[0]] * (1 - right_share) + picture[rows[0], columns[1]] * right_share
    lower = picture[rows[1], columns[0]] * (1 - right_share) + picture[rows[1], columns[1]] * right_share
    return np.asarray(upper * (1 - low_share) + lower * low_share, np.float32)


@dataclass(frozen=True)
class Tint:
    """Colours of places spread over a skin. points: (k, 3) in the file's coordinates; colours: (k, 3), 0 to 255."""

    points: np.ndarray
    colours: np.ndarray
