"""Units and frames: the only file that converts.

Inside Lubdub everything is in millimetres in the body frame: origin at the suprasternal notch, +x to the
patient's left, +y to the head, +z to the front (right-handed: left x head = front). A file's own
coordinates are met only at the door, through a `Similarity`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MM_PER_UNIT = {"m": 1000.0, "cm": 10.0, "mm": 1.0}


@dataclass(frozen=True)
class Similarity:
    """x -> scale * rotation @ x + translation. rotation: (3, 3), det +1; translation: (3,)."""

    scale: float
    rotation: np.ndarray
    translation: np.ndarray

    @staticmethod
    def identity() -> Similarity:
        """The map that moves nothing."""
        return Similarity(1.0, np.eye(3), np.zeros(3))

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Move points (..., 3)."""
        return np.asarray(self.scale * (points @ self.rotation.T) + self.translation)

    def turn(self, directions: np.ndarray) -> np.ndarray:
        """Turn directions (..., 3) such as normals: no scale, no shift."""
        return np.asarray(directions @ self.rotation.T)

    def inverse(self) -> Similarity:
        """The map back."""
        back = self.rotation.T
        return Similarity(1.0 / self.scale, back, -(back @ self.translation) / self.scale)

    def after(self, first: Similarity) -> Similarity:
        """The map that does `first`, then this one."""
        return Similarity(
            self.scale * first.scale,
            self.rotation @ first.rotation,
            self.scale * (self.rotation @ first.translation) + self.translation,
        )

    def matrix(self) -> np.ndarray:
        """(4, 4) homogeneous matrix."""
        out = np.eye(4)
        out[:3, :3] = self.scale * self.rotation
        out[:3, 3] = self.translation
        return out

    @staticmethod
    def from_matrix(matrix: np.ndarray) -> Similarity:
        """From a (4, 4) homogeneous similarity. Raises ValueError for a reflection: Lubdub never mirrors."""
        linear = np.asarray(matrix, np.float64)[:3, :3]
        volume = np.linalg.det(linear)
        if volume <= 0:
            raise ValueError("a similarity may not mirror")
        scale = float(np.cbrt(volume))
        return Similarity(scale, linear / scale, np.asarray(matrix, np.float64)[:3, 3].copy())


def body_axes(up: np.ndarray, front: np.ndarray) -> np.ndarray:
    """(3, 3) rotation whose rows are the body's left, head and front directions.

    up: (3,) towards the head, kept exactly; front: (3,) roughly forward, made perpendicular to up.
    Rows as a rotation: it turns directions of the outer frame into the body frame.
    Raises ValueError when the two are parallel.
    """
    head = up / np.linalg.norm(up)
    forward = front - (front @ head) * head
    length = np.linalg.norm(forward)
    if not length > 1e-9:
        raise ValueError("up and front must not be parallel")
    forward = forward / length
    return np.stack([np.cross(head, forward), head, forward])
