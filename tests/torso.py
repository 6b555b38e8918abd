"""The made-up torso itself: a superellipse tube with breasts, nipples, belly and navel, all known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.results import AreaName, LandmarkName

ADULT_STERNUM_MM = 150.0

# Height above the notch, half breadth, depth from back to front: an adult of average build, in millimetres.
_PROFILE = np.array(
    [
        [110.0, 55.0, 105.0],
        [60.0, 62.0, 108.0],
        [25.0, 110.0, 122.0],
        [0.0, 165.0, 150.0],
        [-60.0, 172.0, 190.0],
        [-150.0, 160.0, 212.0],
        [-260.0, 146.0, 205.0],
        [-370.0, 142.0, 192.0],
        [-480.0, 168.0, 200.0],
    ]
)
_ROUNDNESS = 2.6  # exponent of the superellipse: 2 is an ellipse, more is boxier


@dataclass(frozen=True)
class Shape:
    """A torso. size: 1 is an adult, 0.34 a newborn; breast, belly: 0 flat to 1 full; breadth: 1 is average."""

    size: float = 1.0
    breast: float = 0.15
    belly: float = 0.2
    breadth: float = 1.0

    def half_breadth(self, y: np.ndarray) -> np.ndarray:
        """Half the breadth at height y, both in millimetres."""
        return self.size * self.breadth * np.interp(y / self.size, _PROFILE[::-1, 0], _PROFILE[::-1, 1])

    def depth(self, y: np.ndarray) -> np.ndarray:
        """Back to front at height y."""
        return self.size * np.interp(y / self.size, _PROFILE[::-1, 0], _PROFILE[::-1, 2])

    def front_bumps(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """What breasts, nipples, belly and navel add to the front, in millimetres along +z."""
        s = self.size
        nipple = _nipple(self, 1.0)
        out = 38 * s * self.belly * _bell(x, y + 400 * s, 95 * s)
        out -= 7 * s * _bell(x, y + 367 * s, 8 * s)
        for side in (-1.0, 1.0):
            out += 45 * s * self.breast * _bell(x - side * nipple[0], y - nipple[1] - 12 * s, 48 * s)
            out += 4 * s * _bell(x - side * nipple[0], y - nipple[1], 6 * s)
        return out

    def front(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Height z of the front skin over (x, y)."""
        rim = np.clip(1 - np.abs(x / self.half_breadth(y)) ** _ROUNDNESS, 0, None) ** (1 / _ROUNDNESS)
        middle = self.depth(y) / 2 - 150.0 * self.size
        return middle + self.depth(y) / 2 * rim + self.front_bumps(x, y)


def _bell(x: np.ndarray, y: np.ndarray, width: float) -> np.ndarray:
    return np.asarray(np.exp(-(x * x + y * y) / (2 * width * width)))


def _nipple(shape: Shape, side: float) -> np.ndarray:
    return np.array([side * 95.0 * shape.breadth, -158.0]) * shape.size


def torso_surface(shape: Shape, columns: int = 172, rows: int = 165) -> Surface:
    """The skin from hip to neck as a tube, open at both ends, wound outward."""
    y = np.linspace(_PROFILE[-1, 0], _PROFILE[0, 0], rows)[:, None] * shape.size
    across, out = _even_superellipse(columns)
    x = shape.half_breadth(y) * across
    half_depth = shape.depth(y) / 2
    z = half_depth - 150.0 * shape.size + half_depth * out
    z = z + shape.front_bumps(x, y) * np.clip(out * 4, 0, 1)
    vertices = np.stack(np.broadcast_arrays(x, y, z), 2).reshape(-1, 3)
    return Surface(vertices, tube_triangles(rows, columns))


def _even_superellipse(columns: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit superellipse walked in even steps of an adult chest's girth; the front's middle is one of them."""
    angle = np.linspace(0, 2 * np.pi, 20001)
    power = 2 / _ROUNDNESS
    across = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    out = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    girth = np.concatenate([[0], np.cumsum(np.hypot(np.diff(across) * 1.6, np.diff(out)))])
    even = np.linspace(0, girth[-1], columns, endpoint=False)
    return np.interp(even, girth, across)[None, :], np.interp(even, girth, out)[None, :]


def tube_triangles(rows: int, columns: int) -> np.ndarray:
    """Triangles of a tube of rows times columns vertices, counted row by row."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a = (row * columns + column).ravel()
    b = (row * columns + (column + 1) % columns).ravel()
    return np.concatenate([np.stack([a, a + columns, b], 1), np.stack([b, a + columns, b + columns], 1)])


def landmarks_of(shape: Shape) -> dict[LandmarkName, np.ndarray]:
    """The five landmarks, exactly on the skin."""
    s = shape.size
    left = _nipple(shape, 1.0)
    places: dict[LandmarkName, tuple[float, float]] = {
        "suprasternal_notch": (0.0, 0.0),
        "xiphisternum": (0.0, -ADULT_STERNUM_MM * s),
        "navel": (0.0, -367.0 * s),
        "nipple_left": (left[0], left[1]),
        "nipple_right": (-left[0], left[1]),
    }
    return {name: _on_front(shape, x, y) for name, (x, y) in places.items()}


def areas_of(shape: Shape) -> dict[AreaName, np.ndarray]:
    """The four areas by the ladder of sternum lengths for people of seven and over."""
    sternum = ADULT_STERNUM_MM * shape.size
    steps: dict[AreaName, tuple[float, float]] = {
        "aortic": (-0.17, -0.40),
        "pulmonary": (0.17, -0.40),
        "tricuspid": (0.22, -0.81),
        "mitral": (0.54, -1.06),
    }
    return {name: _on_front(shape, across * sternum, along * sternum) for name, (across, along) in steps.items()}


def _on_front(shape: Shape, x: float, y: float) -> np.ndarray:
    return np.array([x, y, float(shape.front(np.array(x), np.array(y)))])
