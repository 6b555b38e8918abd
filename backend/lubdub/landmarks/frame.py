"""The body frame from landmarks: which way is the head, which way the front."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lubdub.geometry.frames import Similarity, body_axes
from lubdub.geometry.surface import unit
from lubdub.landmarks.reasons import LANDMARKS_IMPLAUSIBLE, SIDES_SWAPPED
from lubdub.results import LandmarkName, ScanRefused

_MIDLINE_SIGMA_MM: dict[str, float] = {"suprasternal_notch": 6.0, "xiphisternum": 6.0, "navel": 10.0, "nipples": 8.0}
"""How far each midline point may lie off the midline, clicks and people together."""

Points = Mapping[LandmarkName, np.ndarray]


def can_frame(landmarks: Points) -> bool:
    """True when these landmarks fix the long axis: two different heights on the midline."""
    return len(_midline(landmarks)) >= 2


def frame_from_landmarks(landmarks: Points, points: np.ndarray, normals: np.ndarray) -> Similarity:
    """The rigid move from the scan's axes (mm) into the body frame.

    landmarks: name -> (3,); points, normals: (n, 3) scan skin with outward normals, same axes.
    Raises ScanRefused when left and right contradict the outside of the skin, or when the points coincide.
    """
    up = long_axis(landmarks)
    outward = _mean_normal(landmarks, points, normals)
    front = outward
    if "nipple_left" in landmarks and "nipple_right" in landmarks:
        left = landmarks["nipple_left"] - landmarks["nipple_right"]
        front = unit(np.cross(left, up))
        if not front @ outward > 0:
            raise ScanRefused(SIDES_SWAPPED)
    try:
        rotation = body_axes(up, front)
    except ValueError as error:
        raise ScanRefused(LANDMARKS_IMPLAUSIBLE) from error
    return Similarity(1.0, rotation, -rotation @ _origin(landmarks, up))


def long_axis(landmarks: Points) -> np.ndarray:
    """(3,) unit direction towards the head: the weighted least-squares line through the midline points."""
    midline = _midline(landmarks)
    names = list(midline)
    weights = np.array([_MIDLINE_SIGMA_MM[name] ** -2 for name in names])
    places = np.array([midline[name] for name in names])
    centred = places - weights @ places / weights.sum()
    direction = np.linalg.svd(centred * np.sqrt(weights)[:, None], full_matrices=False)[2][0]
    towards_head = places[0] - places[-1]
    if not np.linalg.norm(towards_head) > 1.0:
        raise ScanRefused(LANDMARKS_IMPLAUSIBLE)
    return direction if direction @ towards_head > 0 else -direction


def _midline(landmarks: Points) -> dict[str, np.ndarray]:
    """The points on the midline, from the head down; the middle of the nipples is one."""
    found: dict[str, np.ndarray] = {}
    if "suprasternal_notch" in landmarks:
        found["suprasternal_notch"] = landmarks["suprasternal_notch"]
    if "nipple_left" in landmarks and "nipple_right" in landmarks:
        found["nipples"] = (landmarks["nipple_left"] + landmarks["nipple_right"]) / 2
    if "xiphisternum" in landmarks and not ("nipples" in found and len(found) == 1 and "navel" not in landmarks):
        found["xiphisternum"] = landmarks["xiphisternum"]
    if "navel" in landmarks:
        found["navel"] = landmarks["navel"]
    return found


def _mean_normal(landmarks: Points, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Outward direction of the skin around the midline points."""
    places = np.array(list(_midline(landmarks).values()))
    reach = 0.3 * float(np.linalg.norm(places[0] - places[-1]))
    distance = np.min([np.linalg.norm(points - place, axis=1) for place in places], axis=0)
    near = distance < max(reach, float(distance.min()) * 1.5)
    return unit(normals[near].mean(axis=0))


def _origin(landmarks: Points, up: np.ndarray) -> np.ndarray:
    """The suprasternal notch, or a guess at it that later fitting corrects."""
    if "suprasternal_notch" in landmarks:
        return landmarks["suprasternal_notch"]
    midline = list(_midline(landmarks).values())
    span = float(np.linalg.norm(midline[0] - midline[-1]))
    return midline[0] + 0.7 * span * up  # nipples to navel is about 1.4 S, notch to nipples about 1.0 S
