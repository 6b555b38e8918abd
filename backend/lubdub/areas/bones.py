"""The breastbone as believed: clicked points, fitted points and growth tables, each by its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.areas.anatomy import STERNUM_SPREAD, sternum_length_mm
from lubdub.areas.rule import Breastbone
from lubdub.results import BONE_LANDMARKS, LandmarkName, Landmarks, Patient


@dataclass(frozen=True)
class BoneSettings:
    """How much each source of a bone point is trusted; one standard deviation."""

    fitted_across_mm: float = 3.0
    """The midline of a fitted body: symmetric skin fixes it to 2 mm on simulated people, none of them bent."""
    fitted_along_share: float = 0.11
    """Height of a fitted bone point, in shares of the breastbone's length: 0.1 on simulated people, mostly what skin
    cannot know of bones."""
    fitted_along_breasts_share: float = 0.16
    """The same in women after puberty (a real woman from CT: 5-25 mm for S = 145)."""
    age_unknown_spread: float = 0.2
    """Spread of the breastbone's length when nobody said the age."""
    nipples_below_notch: tuple[float, float] = (1.0, 0.11)
    """Nipple line below the notch in expected breastbone lengths, and its spread: men 0.85-1.15 (whole range),
    children as men, and 8 % for the length itself."""
    breast_nipples_below_notch: tuple[float, float] = (1.0, 0.18)
    """The same in women after puberty: 0.65-1.3."""
    navel_below_notch: tuple[float, float] = (2.45, 0.25)
    """Navel below the notch: 2.2-2.7, and 8 % for the length."""


def believe(
    clicked: Landmarks,
    fitted: Mapping[LandmarkName, np.ndarray],
    patient: Patient,
    settings: BoneSettings | None = None,
) -> Breastbone:
    """The breastbone that agrees best with everything known; body frame, +y along the body.

    clicked: the landmarks given or suggested; fitted: name -> (3,) from a body bent onto the scan, may be empty.
    Along the body the two heights are one linear least-squares problem: clicks, fit, and, with a fit or without both
    clicks, the length expected for the age: clicks alone are a plain ruler. Raises ValueError when nothing fixes a
    bone point.
    """
    settings = settings or BoneSettings()
    expected, length_sigma = _expected_length(fitted, patient, settings)
    along_sigma = expected * (
        settings.fitted_along_breasts_share if patient.may_have_breasts else settings.fitted_along_share
    )
    information, vector = np.zeros((2, 2)), np.zeros(2)
    across, depth = np.zeros((2, 2)), np.zeros(2)
    for row, name in enumerate(BONE_LANDMARKS):
        sources = _sources(name, clicked, fitted, settings.fitted_across_mm, along_sigma)
        if not sources:
            raise ValueError(f"nothing says where the {name} is")
        for position, _, height_sigma in sources:
            information[row, row] += height_sigma**-2
            vector[row] += position[1] * height_sigma**-2
        weights = np.array([source[1] ** -2 for source in sources])
        positions = np.array([source[0] for source in sources])
        across[row] = weights @ positions[:, 0] / weights.sum(), weights.sum() ** -0.5
        depth[row] = weights @ positions[:, 2] / weights.sum()
    for height, sigma in _notch_from_skin(clicked, patient, expected, settings):
        information[0, 0] += sigma**-2
        vector[0] += height * sigma**-2
    if fitted or not all(name in clicked for name in BONE_LANDMARKS):
        difference = np.array([1.0, -1.0])
        information += np.outer(difference, difference) / length_sigma**2
        vector += difference * expected / length_sigma**2
    covariance = np.linalg.inv(information)
    heights = covariance @ vector
    ends = np.stack([across[:, 0], heights, depth], axis=1)
    sigmas = np.stack([across[:, 1], np.sqrt(np.diag(covariance))], axis=1)
    return Breastbone(ends[0], ends[1], sigmas[0], sigmas[1])


def _expected_length(
    fitted: Mapping[LandmarkName, np.ndarray], patient: Patient, settings: BoneSettings
) -> tuple[float, float]:
    if patient.age_years is not None:
        expected = sternum_length_mm(patient.age_years, patient.sex)
        return expected, STERNUM_SPREAD * expected
    if all(name in fitted for name in BONE_LANDMARKS):
        notch, joint = (fitted[name] for name in BONE_LANDMARKS)
        return float(notch[1] - joint[1]), settings.age_unknown_spread * float(notch[1] - joint[1])
    expected = sternum_length_mm(30, patient.sex)
    return expected, settings.age_unknown_spread * expected


def _notch_from_skin(
    clicked: Landmarks, patient: Patient, expected: float, settings: BoneSettings
) -> list[tuple[float, float]]:
    """(height, sigma) of the notch as clicked nipples and navel let one guess it; nothing when it was clicked."""
    if "suprasternal_notch" in clicked or patient.age_years is None:
        return []
    nipples = settings.breast_nipples_below_notch if patient.may_have_breasts else settings.nipples_below_notch
    heights = []
    if "nipple_left" in clicked and "nipple_right" in clicked:
        line = (clicked["nipple_left"].position[1] + clicked["nipple_right"].position[1]) / 2
        heights.append((float(line) + nipples[0] * expected, nipples[1] * expected))
    if "navel" in clicked:
        share, spread = settings.navel_below_notch
        heights.append((float(clicked["navel"].position[1]) + share * expected, spread * expected))
    return heights


def _sources(
    name: LandmarkName,
    clicked: Landmarks,
    fitted: Mapping[LandmarkName, np.ndarray],
    fitted_across: float,
    fitted_along: float,
) -> list[tuple[np.ndarray, float, float]]:
    """What is known of one bone point: (position (3,), sigma across, sigma along) from each source."""
    sources = []
    if name in clicked:
        landmark = clicked[name]
        sources.append((landmark.position, landmark.uncertainty_mm, landmark.uncertainty_mm))
    if name in fitted:
        sources.append((fitted[name], fitted_across, fitted_along))
    return sources
