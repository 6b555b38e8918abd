"""Landmarks that nobody clicked, proposed from a fitted body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.results import LANDMARK_NAMES, CleanScan, Fit, Landmark, LandmarkName


@dataclass(frozen=True)
class SuggestionSettings:
    """How far a suggestion may be off, one standard deviation, as a share of the notch-navel length.

    On simulated scans without any click: notch median 6-7 mm, lower end of the breastbone 9, navel 13, nipples 20 and
    95 in 100 within 16, 29, 39 and 46; the bone points are worse on real anatomy, because skin does not fix the bones.
    """

    notch: float = 0.06
    xiphisternum: float = 0.08
    navel: float = 0.06
    nipple: float = 0.075


def suggest(scan: CleanScan, fit: Fit, settings: SuggestionSettings | None = None) -> dict[LandmarkName, Landmark]:
    """All five landmarks on the scan's skin, body frame, each with how sure we are."""
    settings = settings or SuggestionSettings()
    shares = (settings.notch, settings.xiphisternum, settings.navel, settings.nipple, settings.nipple)
    length = float(np.linalg.norm(fit.landmarks["suprasternal_notch"] - fit.landmarks["navel"]))
    tree = cKDTree(scan.points)
    suggested: dict[LandmarkName, Landmark] = {}
    for name, share in zip(LANDMARK_NAMES, shares, strict=True):
        distance, nearest = tree.query(fit.landmarks[name])
        sigma = float(np.hypot(share * length, distance))
        suggested[name] = Landmark(scan.points[nearest].copy(), "suggested", sigma)
    return suggested
