"""The breastbone as believed: clicked points and fitted points, each by its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.areas.rule import Breastbone
from lubdub.results import BONE_LANDMARKS, LandmarkName, Landmarks, Patient


@dataclass(frozen=True)
class BoneSettings:
    """How much the bone points of a fitted body are trusted; one standard deviation each.

    Clicks are trusted as far as they say themselves.
    """

    across_mm: float = 3.0
    """The midline of a fitted body: symmetric skin fixes it to 2 mm on simulated people, none of them bent; on a
    modelled woman of another origin it was 2 mm aside at the notch and 1 mm at the lower end. Half as much again."""
    notch_along_share: float = 0.05
    """Height of the fitted notch, in shares of the breastbone's length. The hollow of the neck shows where it is: 0.048
    on 80 simulated people whose bones were drawn apart from their skin, by 0.04 and more."""
    joint_along_share: float = 0.11
    """Height of the fitted lower end, of which skin shows nothing: 0.104 on the same people."""
    joint_along_breasts_share: float = 0.12
    """The same in women after puberty: 17 mm on the modelled woman (S = 144)."""
    alike: float = 0.7
    """Correlation of the two ends' errors: a body fitted too high has both its ends too high. 0.7 there."""


def believe(
    clicked: Landmarks,
    fitted: Mapping[LandmarkName, np.ndarray],
    patient: Patient,
    settings: BoneSettings | None = None,
) -> Breastbone:
    """The breastbone that agrees best with everything known; body frame, +y along the body.

    clicked: the landmarks given or suggested; fitted: name -> (3,) from a body bent onto the scan, both ends or none;
    it has already heard of age, nipples and navel. Both ends are one Gaussian: means weighted by inverse covariances.
    Raises ValueError when nothing fixes a bone point.
    """
    settings = settings or BoneSettings()
    for name in BONE_LANDMARKS:
        if name not in clicked and name not in fitted:
            raise ValueError(f"nothing says where the {name} is")
    clicks, trust = _clicks(clicked)
    ends = np.array([fitted[name] for name in BONE_LANDMARKS]) if fitted else np.zeros((2, 3))
    across, along = _fitted_trust(ends, patient, settings) if fitted else np.zeros((2, 2, 2))
    across_covariance, along_covariance = np.linalg.inv(trust + across), np.linalg.inv(trust + along)
    believed = across_covariance @ (trust @ clicks + across @ ends)
    believed[:, 1] = along_covariance @ (trust @ clicks[:, 1] + along @ ends[:, 1])
    return Breastbone(believed[0], believed[1], across_covariance, along_covariance)


def _clicks(clicked: Landmarks) -> tuple[np.ndarray, np.ndarray]:
    """(2, 3) the clicked ends, and (2, 2) their inverse covariance; nought for one that was not clicked."""
    ends, trust = np.zeros((2, 3)), np.zeros((2, 2))
    for row, name in enumerate(BONE_LANDMARKS):
        if name in clicked:
            ends[row], trust[row, row] = clicked[name].position, clicked[name].uncertainty_mm ** -2.0
    return ends, trust


def _fitted_trust(ends: np.ndarray, patient: Patient, settings: BoneSettings) -> tuple[np.ndarray, np.ndarray]:
    """(2, 2) the inverse covariances of a fitted body's two ends (2, 3), across and along."""
    joint = settings.joint_along_breasts_share if patient.may_have_breasts else settings.joint_along_share
    along = np.array([settings.notch_along_share, joint]) * np.linalg.norm(ends[0] - ends[1])
    alike = np.array([[1.0, settings.alike], [settings.alike, 1.0]])
    return np.linalg.inv(alike * settings.across_mm**2), np.linalg.inv(alike * np.outer(along, along))
