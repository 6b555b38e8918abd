"""Where to stand to see a chest: collarbones to navel, head up, whatever the window's shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.surface import unit
from lubdub.results import Area, CleanScan, Landmarks

FIELD_OF_VIEW = 0.6
"""Vertical, radians: a long lens, so that the chest does not bulge."""
MARGIN = 1.12
ABOVE_NOTCH = 0.10
"""Share of the trunk's length shown above the notch: collarbones and a little neck."""
BELOW_NAVEL = 0.08
TRUNK_HALF_BREADTH = 0.6
"""Share of the way from notch to navel: a broad chest with a little of the upper arms."""
NEARER = 0.75
"""Share of the distance to the whole chest from which one place is looked at: whose left is left stays in sight."""
TOWARDS = 0.5
"""How far the look moves from the chest's middle to the place."""
USUAL_ASPECT = 0.85
"""Width over height the host pages give the view on a phone and on a desk."""


@dataclass(frozen=True)
class Camera:
    """position, look_at: (3,) mm in the body frame; up is always the head."""

    position: np.ndarray
    look_at: np.ndarray


def framed(scan: CleanScan, landmarks: Landmarks, aspect: float = USUAL_ASPECT) -> Camera:
    """The camera that shows the chest from the front. aspect: window width over height."""
    points = scan.points
    bottom, top = np.percentile(points[:, 1], [1.0, 99.0])
    if "navel" in landmarks:
        trunk = abs(float(landmarks["navel"].position[1]))
        top = min(top, ABOVE_NOTCH * trunk)
        bottom = max(bottom, -trunk * (1 + BELOW_NAVEL))
    shown = points[(points[:, 1] >= bottom) & (points[:, 1] <= top)]
    if len(shown) == 0:
        shown = points
    left, right = np.percentile(shown[:, 0], [2.0, 98.0])
    if "navel" in landmarks:
        # Arms may leave the picture: the trunk is what people look at.
        middle, half = float(landmarks["navel"].position[0]), TRUNK_HALF_BREADTH * trunk
        left, right = max(left, middle - half), min(right, middle + half)
    centre = np.array([(left + right) / 2, (top + bottom) / 2, np.percentile(shown[:, 2], 80.0)])
    height = max(top - bottom, (right - left) / max(aspect, 0.2)) * MARGIN
    distance = height / 2 / np.tan(FIELD_OF_VIEW / 2)
    # A little from above, as a parent leans over a child who lies down: the ribs read better than straight on.
    return Camera(centre + distance * np.array([0.0, -0.06, 0.998]), centre)


def close_to(area: Area, whole: Camera) -> Camera:
    """The camera that looks at one place, half-way along its skin's normal, from where the whole chest is seen."""
    look_at = whole.look_at + TOWARDS * (area.position - whole.look_at)
    straight = whole.position - whole.look_at
    towards = unit(unit(straight) + 0.6 * unit(area.normal))
    return Camera(look_at + NEARER * float(np.linalg.norm(straight)) * towards, look_at)
