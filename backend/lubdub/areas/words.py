"""Where an area is, said with what a person can see and feel."""

from __future__ import annotations

import numpy as np

from lubdub.results import AreaName

_FINGER_MM = 18.0
"""Breadth of an adult's finger, for people without a ruler."""


def instruction(name: AreaName, place: np.ndarray, notch: np.ndarray) -> str:
    """One sentence for one area. place, notch: (3,) body frame; the notch is the top edge of the breastbone."""
    below = float(notch[1] - place[1])
    left = float(place[0] - notch[0])
    side = "left" if left >= 0 else "right"
    return (
        f"{_TITLES[name]}: {_length(below)} straight down from the top edge of the breastbone, "
        f"then {_length(abs(left))} to the patient's {side}. Hold the chestpiece flat there."
    )


_TITLES: dict[AreaName, str] = {
    "aortic": "Place 1 (A, aortic)",
    "pulmonary": "Place 2 (P, pulmonary)",
    "tricuspid": "Place 3 (T, tricuspid)",
    "mitral": "Place 4 (M, mitral)",
}


def _length(mm: float) -> str:
    half_cm = round(mm / 5) * 5 / 10
    fingers = max(1, round(mm / _FINGER_MM))
    number = f"{half_cm:g} cm"
    return f"{number} (about {fingers} finger-width{'s' if fingers > 1 else ''})"
