"""Landmarks that nobody clicked: bones as the fitted body has them, navel and nipples by the skin's own relief and
colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.colour import Tint
from lubdub.geometry.signs import Signs
from lubdub.landmarks.places import Found, find_navel, find_nipples
from lubdub.landmarks.relief import UNSEEN, Skin
from lubdub.results import BONE_LANDMARKS, CleanScan, Fit, Landmark, LandmarkName

NOTCH_TO_NAVEL = 2.45
"""In units of length of `landmarks.relief`: about a breastbone."""
TRUNK_SAYS = 0.015
"""Skin nearest to fitted skin that tells a fit less than this is an arm's; each vertex of a nipple's dense rings tells
0.02. With 0.3 the skin around the fitted nipples was left out, and nipples were 13 mm off instead of 8."""


@dataclass(frozen=True)
class SuggestionSettings:
    """How far a suggested bone may be off, one standard deviation, as a share of the notch-navel length.

    On simulated scans without any click: notch median 6-7 mm, lower end of the breastbone 9, and 95 in 100 within 16
    and 29; worse on real anatomy, because skin does not fix the bones.
    """

    notch: float = 0.06
    xiphisternum: float = 0.08


def suggest(
    scan: CleanScan,
    fit: Fit,
    data_weight: np.ndarray,
    signs: Signs,
    tint: Tint | None = None,
    settings: SuggestionSettings | None = None,
) -> dict[LandmarkName, Landmark]:
    """All five landmarks on the scan's skin, body frame, each with how sure we are.

    data_weight: (n,) of the fitted body's vertices, as in `ShapeBasis`; tint: the scan's colours, if any.
    """
    length = _length(fit)
    skin = _trunk(scan, fit, data_weight, length / NOTCH_TO_NAVEL, tint)
    left, right = find_nipples(skin, fit.landmarks["nipple_left"], fit.landmarks["nipple_right"], signs)
    navel = find_navel(skin, fit.landmarks["navel"], signs)
    bones = suggest_bones(scan, fit, settings)
    return bones | {"navel": _mark(navel), "nipple_left": _mark(left), "nipple_right": _mark(right)}


def suggest_bones(
    scan: CleanScan, fit: Fit, settings: SuggestionSettings | None = None
) -> dict[LandmarkName, Landmark]:
    """The two ends of the breastbone alone: where the fitted body has them, on the scan's skin."""
    settings = settings or SuggestionSettings()
    length = _length(fit)
    fitted = np.array([fit.landmarks[name] for name in BONE_LANDMARKS])
    distance, nearest = cKDTree(scan.points).query(fitted)
    places = _flat_on(scan.points[nearest], scan.normals[nearest], fitted, UNSEEN * length / NOTCH_TO_NAVEL)
    doubts = np.hypot(np.array([settings.notch, settings.xiphisternum]) * length, distance)
    return {
        name: Landmark(place, "suggested", float(doubt))
        for name, place, doubt in zip(BONE_LANDMARKS, places, doubts, strict=True)
    }


def _flat_on(points: np.ndarray, normals: np.ndarray, places: np.ndarray, reach: float) -> np.ndarray:
    """(k, 3) feet of places (k, 3) on the skin through the points nearest to them, no farther from these than reach."""
    gaps = places - points
    along = gaps - (gaps * normals).sum(axis=1, keepdims=True) * normals
    near = np.linalg.norm(along, axis=1, keepdims=True) < reach
    return np.where(near, points + along, points)


def _length(fit: Fit) -> float:
    return float(np.linalg.norm(fit.landmarks["suprasternal_notch"] - fit.landmarks["navel"]))


def _trunk(scan: CleanScan, fit: Fit, data_weight: np.ndarray, size: float, tint: Tint | None) -> Skin:
    says = data_weight[cKDTree(fit.surface.vertices).query(scan.points)[1]] > TRUNK_SAYS
    kept = says if says.any() else np.ones(len(scan.points), bool)
    here = None if tint is None else Tint(scan.body_from_file.apply(tint.points), tint.colours)
    return Skin(scan.points[kept], scan.normals[kept], size, here)


def _mark(found: Found) -> Landmark:
    return Landmark(found.position, "suggested", found.doubt_mm)
