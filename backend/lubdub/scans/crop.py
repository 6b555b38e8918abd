"""What lies far from the landmarks is not the chest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.results import LandmarkName


@dataclass(frozen=True)
class CropSettings:
    """In lengths from notch to navel, which is 2.2-2.7 sternum lengths (reference bodies' notes)."""

    above_notch: float = 0.75
    below_navel: float = 0.35
    around: float = 1.0
    """Radius about the line from notch to navel: shoulders and upper arms of broad people lie within 0.75."""
    notch_to_nipples: float = 0.41
    """Nipples lie about one sternum length below the notch, the navel 2.45."""
    notch_to_xiphisternum: float = 0.41
    slack: float = 1.35
    """More room all round when notch or navel had to be guessed."""


SETTINGS = CropSettings()


def near_landmarks(points: np.ndarray, landmarks: Mapping[LandmarkName, np.ndarray], wider: float = 1.0) -> np.ndarray:
    """(n,) bool: True in a generous tube round the trunk; True everywhere when too few landmarks are known.

    points: (n, 3) mm; landmarks: name -> (3,) in the same frame. wider: a tube this many times as large.
    """
    ends = _notch_and_navel(landmarks)
    if ends is None:
        return np.ones(len(points), bool)
    notch, navel, is_sure = ends
    length = float(np.linalg.norm(navel - notch))
    if length < 1e-6:
        return np.ones(len(points), bool)
    room = wider * (1.0 if is_sure else SETTINGS.slack)
    along = (points - notch) @ (navel - notch) / length
    aside_squared = ((points - notch) ** 2).sum(axis=1) - along**2
    keep = along > -SETTINGS.above_notch * room * length
    keep &= along < (1 + SETTINGS.below_navel * room) * length
    return np.asarray(keep & (aside_squared < (SETTINGS.around * room * length) ** 2))


def _notch_and_navel(landmarks: Mapping[LandmarkName, np.ndarray]) -> tuple[np.ndarray, np.ndarray, bool] | None:
    notch, navel = landmarks.get("suprasternal_notch"), landmarks.get("navel")
    xiphisternum = landmarks.get("xiphisternum")
    if notch is not None and navel is not None:
        return notch, navel, True
    if notch is not None and xiphisternum is not None:
        return notch, notch + (xiphisternum - notch) / SETTINGS.notch_to_xiphisternum, False
    nipples = _between_nipples(landmarks)
    if nipples is None or navel is None:
        return None
    return navel + (nipples - navel) / (1 - SETTINGS.notch_to_nipples), navel, False


def _between_nipples(landmarks: Mapping[LandmarkName, np.ndarray]) -> np.ndarray | None:
    left, right = landmarks.get("nipple_left"), landmarks.get("nipple_right")
    return None if left is None or right is None else (left + right) / 2
