"""How far one walks along the skin to a place: straight down, then straight to the side, as a tape measure lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.raycast import SkinCaster

STEP_MM = 5.0
SMOOTHED = 1
"""Neighbours on each side over which the skin's height is averaged: a scan's noise must not lengthen the way."""
ABOVE_MM = 1000.0


@dataclass(frozen=True)
class Whereabouts:
    """A place, from a point of reference. down_mm: towards the feet; left_mm: to the patient's left; both may be
    negative, both are lengths along the skin."""

    down_mm: float
    left_mm: float


def whereabouts(skin: SkinCaster, place: np.ndarray, reference: np.ndarray) -> Whereabouts:
    """The way to place (3,) from reference (3,), mm, body frame. Over holes in the scan the way goes straight."""
    corner = np.array([reference[0], place[1]])
    down = float(reference[1] - place[1])
    left = float(place[0] - reference[0])
    return Whereabouts(
        float(np.copysign(_length(skin, reference[:2], corner), down)),
        float(np.copysign(_length(skin, corner, place[:2]), left)),
    )


def _length(skin: SkinCaster, start: np.ndarray, end: np.ndarray) -> float:
    """Of the skin under the straight way from start (2,) to end (2,), seen from the front."""
    flat = float(np.linalg.norm(end - start))
    count = max(2, round(flat / STEP_MM) + 1)
    share = np.linspace(0.0, 1.0, count)
    way = start + share[:, None] * (end - start)
    origins = np.column_stack([way, np.full(count, ABOVE_MM)])
    hits = skin.cast(origins, np.array([0.0, 0.0, -1.0]))
    if hits.met.sum() < 2:
        return flat
    height = np.interp(share, share[hits.met], hits.points[hits.met, 2])
    padded = np.pad(height, SMOOTHED, mode="reflect", reflect_type="odd")
    height = np.convolve(padded, np.full(2 * SMOOTHED + 1, 1 / (2 * SMOOTHED + 1)), mode="valid")
    return float(np.hypot(np.diff(height), flat / (count - 1)).sum())
