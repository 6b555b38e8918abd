"""Can these points belong to one body of this age? Looks at distances and order only."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.landmarks import reasons
from lubdub.results import LANDMARK_NAMES, CleanScan, LandmarkName, Reason, ScanRefused


@dataclass(frozen=True)
class LandmarkLimits:
    """Ranges in shares of the breastbone's length S; beyond `care` we warn, beyond `refuse` we stop.

    People: navel 2.2-2.7 S below the notch, nipples 0.4-0.75 S from the midline and 0.65-1.3 S below the notch;
    S within 8 % (one standard deviation) of what age and sex let one expect. The limits add room for clicks.
    """

    off_skin_mm: float = 30.0
    click_mm: float = 8.0
    """How far off a click may be. The limits have room for that on an adult; on a baby it is a sixth of S, so the
    `care` limits widen by what it is more."""
    adult_mm: float = 150.0
    length_care: tuple[float, float] = (0.72, 1.28)
    length_refuse: tuple[float, float] = (0.6, 1.5)
    navel_care: tuple[float, float] = (1.65, 3.5)
    navel_refuse: tuple[float, float] = (1.3, 4.2)
    nipple_aside_care: tuple[float, float] = (0.33, 1.2)
    """Lying women with large breasts reach 0.9."""
    nipple_aside_refuse: tuple[float, float] = (0.15, 1.4)
    nipple_below_care: tuple[float, float] = (0.45, 1.6)
    nipple_below_refuse: tuple[float, float] = (0.2, 2.0)


def check_landmarks(
    scan: CleanScan,
    given: Mapping[LandmarkName, np.ndarray],
    expected_length_mm: float | None,
    limits: LandmarkLimits | None = None,
) -> tuple[Reason, ...]:
    """What is odd about the given landmarks; body frame, mm. Raises ScanRefused for the impossible.

    expected_length_mm: breastbone length for the age and sex, None when the age was not said.
    """
    limits = limits or LandmarkLimits()
    _check_on_skin(scan, given, limits)
    _check_order(given)
    length, warnings = _check_length(given, expected_length_mm, limits)
    if length is None:
        return warnings
    worst = _worst(_shares(given, length), limits, _slack(length, limits))
    if worst == "refuse":
        raise ScanRefused(reasons.LANDMARKS_IMPLAUSIBLE)
    return (*warnings, reasons.LANDMARKS_UNUSUAL) if worst == "care" else warnings


def _check_on_skin(scan: CleanScan, given: Mapping[LandmarkName, np.ndarray], limits: LandmarkLimits) -> None:
    tree = cKDTree(scan.points)
    for name, position in given.items():
        if tree.query(position)[0] > limits.off_skin_mm:
            raise ScanRefused(reasons.off_body(name))


def _check_order(given: Mapping[LandmarkName, np.ndarray]) -> None:
    spine = [given[name][1] for name in LANDMARK_NAMES[:3] if name in given]
    if any(upper <= lower for upper, lower in itertools.pairwise(spine)):
        raise ScanRefused(reasons.UPSIDE_DOWN)
    if "nipple_left" in given and "nipple_right" in given and given["nipple_left"][0] <= given["nipple_right"][0]:
        raise ScanRefused(reasons.SIDES_SWAPPED)


def _check_length(
    given: Mapping[LandmarkName, np.ndarray], expected: float | None, limits: LandmarkLimits
) -> tuple[float | None, tuple[Reason, ...]]:
    """The breastbone's length to measure with, and what is odd about the clicked one."""
    if not ("suprasternal_notch" in given and "xiphisternum" in given):
        return expected, ()
    length = float(given["suprasternal_notch"][1] - given["xiphisternum"][1])
    if expected is None:
        if not 35 <= length <= 230:
            raise ScanRefused(reasons.BREASTBONE_IMPLAUSIBLE)
        return length, ()
    if not limits.length_refuse[0] <= length / expected <= limits.length_refuse[1]:
        raise ScanRefused(reasons.BREASTBONE_IMPLAUSIBLE)
    unusual = not _within(length / expected, limits.length_care, _slack(expected, limits))
    return length, (reasons.BREASTBONE_UNUSUAL,) if unusual else ()


def _shares(given: Mapping[LandmarkName, np.ndarray], length: float) -> list[tuple[str, float]]:
    """(what, how much in S) for each distance that can be measured."""
    shares = []
    notch = given.get("suprasternal_notch")
    if notch is not None and "navel" in given:
        shares.append(("navel", float(notch[1] - given["navel"][1]) / length))
    if "nipple_left" in given and "nipple_right" in given:
        middle = (given["nipple_left"][0] + given["nipple_right"][0]) / 2 if notch is None else notch[0]
        shares += [("nipple_aside", abs(float(given[n][0] - middle)) / length) for n in LANDMARK_NAMES[3:]]
        if notch is not None:
            shares += [("nipple_below", float(notch[1] - given[n][1]) / length) for n in LANDMARK_NAMES[3:]]
    return shares


def _slack(length: float, limits: LandmarkLimits) -> float:
    """By how much a click's error is a larger share of this breastbone than of an adult's."""
    return max(0.0, limits.click_mm / length - limits.click_mm / limits.adult_mm)


def _within(share: float, limits: tuple[float, float], slack: float) -> bool:
    return limits[0] - slack <= share <= limits[1] + slack


def _worst(shares: list[tuple[str, float]], limits: LandmarkLimits, slack: float) -> str:
    worst = "fine"
    for what, share in shares:
        refuse, care = getattr(limits, f"{what}_refuse"), getattr(limits, f"{what}_care")
        if not refuse[0] <= share <= refuse[1]:
            return "refuse"
        if not _within(share, care, slack):
            worst = "care"
    return worst
