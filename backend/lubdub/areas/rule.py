"""From two bone points and the body's axes to the four areas: the anatomy table used as a ruler."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.areas.anatomy import Place, places
from lubdub.results import AREA_NAMES, AreaName, Estimate


@dataclass(frozen=True)
class Breastbone:
    """The breastbone as believed, body frame. notch, joint: (3,), where joint is the xiphisternal joint.

    across_mm2, along_mm2: (2, 2) how unsure the two are across and along the body, as covariances of notch and joint.
    tilt_sigma_rad: how unsure the direction of the body's long axis is.
    """

    notch: np.ndarray
    joint: np.ndarray
    across_mm2: np.ndarray
    along_mm2: np.ndarray
    tilt_sigma_rad: float = 0.035

    @property
    def length_mm(self) -> float:
        """S, along the body's long axis."""
        return float(self.notch[1] - self.joint[1])


def place_areas(bone: Breastbone, age_years: float) -> dict[AreaName, Estimate]:
    """The four areas by the rule, in the frontal plane of a body frame whose +y is the long axis.

    The returned z is that of the breastbone's line; `project.drop_on_skin` brings the points to the skin.
    """
    table = places(age_years)
    return {name: _place(bone, table[name]) for name in AREA_NAMES}


def _place(bone: Breastbone, place: Place) -> Estimate:
    length = bone.length_mm
    on_midline = bone.notch + place.below * (bone.joint - bone.notch)
    across = place.left * length
    position = on_midline + np.array([across, 0.0, 0.0])
    return Estimate(position, np.sqrt(_variance(bone, place, across)))


def _variance(bone: Breastbone, place: Place, across: float) -> np.ndarray:
    """(2,) variances across and along: bone points, long axis and the spread between people."""
    length = bone.length_mm
    level, span = np.array([1 - place.below, place.below]), np.array([1.0, -1.0])
    from_bones = np.array([level @ bone.across_mm2 @ level, level @ bone.along_mm2 @ level])
    scale = np.array([place.left**2 * (span @ bone.along_mm2 @ span), 0.0])
    tilt = np.array([0.0, (across * bone.tilt_sigma_rad) ** 2])
    people = (length * np.array([place.spread_left, place.spread_below])) ** 2
    return from_bones + scale + tilt + people


def region_radius_mm(sigma_mm: np.ndarray, held: float = 0.9) -> float:
    """Radius of the circle that holds a centred 2D normal with these two sigmas (2,) `held` of the time.

    P(outside r) = 1/(2 pi s1 s2) * integral of exp(-r² q/2)/q over the angle, q = cos²/s1² + sin²/s2².
    """
    first, second = np.maximum(sigma_mm, 1e-6)
    angle = (np.arange(256) + 0.5) * (2 * np.pi / 256)
    q = np.cos(angle) ** 2 / first**2 + np.sin(angle) ** 2 / second**2
    low, high = 0.0, 5.0 * float(max(first, second))
    for _ in range(50):
        middle = (low + high) / 2
        outside = float(np.mean(np.exp(-(middle**2) * q / 2) / q) / (first * second))
        low, high = (middle, high) if outside > 1 - held else (low, middle)
    return high


def sigma_on_skin(sigma_mm: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(2,) the sigmas along the skin of a place whose frontal sigmas are (2,); normal: (3,) of the skin there.

    On skin z = -(n_x x + n_y y) / n_z an offset d in the frontal plane is J d in space, J = [I; -n_xy / n_z]: the
    sigmas are the singular values of J diag(sigma). Steeper than `STEEPEST` the frontal view says nothing more.
    """
    slope = -normal[:2] / max(float(normal[2]), STEEPEST)
    return np.linalg.svd(np.vstack([np.eye(2), slope]) * sigma_mm, compute_uv=False)


STEEPEST = 0.4
"""Smallest cosine to the front that a region follows."""


def distance_mm(first: Mapping[AreaName, np.ndarray], second: Mapping[AreaName, np.ndarray]) -> float:
    """The largest frontal distance between two sets of areas: how far two methods disagree."""
    return max(float(np.linalg.norm((first[name] - second[name])[:2])) for name in AREA_NAMES)
