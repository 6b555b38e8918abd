"""Can these points belong to one body of this age? Looks at distances and order only."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.landmarks import reasons
from lubdub.results import BONE_LANDMARKS, LANDMARK_NAMES, CleanScan, LandmarkName, Reason, ScanRefused


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
    length_anyone: tuple[float, float] = (35.0, 230.0)
    """mm, of any person, when the age was not said."""
    length_care: tuple[float, float] = (0.68, 1.3)
    """Of what age lets one expect: people differ by 8 % and by their stature, clicks by 6 %.

    Tighter above: the hollow clicked instead of the bone makes it too long."""
    length_refuse: tuple[float, float] = (0.6, 1.5)
    navel_care: tuple[float, float] = (1.65, 3.5)
    navel_refuse: tuple[float, float] = (1.3, 4.2)
    nipple_aside_care: tuple[float, float] = (0.33, 1.2)
    """Lying women with large breasts reach 0.9."""
    nipple_aside_refuse: tuple[float, float] = (0.15, 1.4)
    nipple_below_care: tuple[float, float] = (0.45, 1.6)
    nipple_below_refuse: tuple[float, float] = (0.2, 2.0)
    nipples_to_navel_care: tuple[float, float] = (0.7, 2.4)
    """Looked at only without the notch, so in breastbones that the age lets one expect: 0.7-2.1 in 98 of 100 simulated
    people, up to 2.5 in babies. Of a child of six said to be half a year old 2.8."""
    nipples_to_navel_refuse: tuple[float, float] = (0.45, 3.0)


@dataclass(frozen=True)
class Oddity:
    """Something odd about points. what: a word for what it is; names: the points to look at again, the likeliest first.

    is_grave: such a body cannot be; otherwise it is only unusual.
    """

    what: str
    reason: Reason
    names: tuple[LandmarkName, ...]
    is_grave: bool


def check_landmarks(
    scan: CleanScan,
    given: Mapping[LandmarkName, np.ndarray],
    expected_length_mm: float | None,
    limits: LandmarkLimits | None = None,
) -> tuple[Reason, ...]:
    """What is odd about the given landmarks; body frame, mm. Raises ScanRefused for the impossible.

    expected_length_mm: breastbone length for the age and sex, None when the age was not said.
    """
    found = oddities(scan, given, expected_length_mm, limits)
    for oddity in found:
        if oddity.is_grave:
            raise ScanRefused(oddity.reason)
    return tuple(dict.fromkeys(oddity.reason for oddity in found))


def oddities(
    scan: CleanScan,
    given: Mapping[LandmarkName, np.ndarray],
    expected_length_mm: float | None,
    limits: LandmarkLimits | None = None,
) -> tuple[Oddity, ...]:
    """As `check_landmarks`, with everything that is odd and nothing raised."""
    limits = limits or LandmarkLimits()
    found = [*_off_skin(scan, given, limits), *out_of_order(given)]
    length, odd_length = _check_length(given, expected_length_mm, limits)
    found += odd_length
    if length is not None and length > 0:
        found += _odd_shares(given, length, limits)
    return tuple(found)


def _off_skin(scan: CleanScan, given: Mapping[LandmarkName, np.ndarray], limits: LandmarkLimits) -> list[Oddity]:
    tree = cKDTree(scan.points)
    return [
        Oddity("off_body", reasons.OFF_BODY[name], (name,), is_grave=True)
        for name, position in given.items()
        if tree.query(position)[0] > limits.off_skin_mm
    ]


def out_of_order(given: Mapping[LandmarkName, np.ndarray]) -> list[Oddity]:
    """Points of the midline that do not run downwards, nipples on each other's side; +y head, +x patient's left."""
    found = []
    spine = [name for name in LANDMARK_NAMES[:3] if name in given]
    wrong = [pair for pair in itertools.pairwise(spine) if given[pair[0]][1] <= given[pair[1]][1]]
    if wrong:
        found.append(Oddity("order", reasons.UPSIDE_DOWN, wrong[0], is_grave=True))
    if wrong_side := _nipples_on_the_wrong_side(given, given[spine[0]][0] if spine else None):
        found.append(Oddity("sides", reasons.SIDES_SWAPPED, wrong_side, is_grave=True))
    return found


def _nipples_on_the_wrong_side(
    given: Mapping[LandmarkName, np.ndarray], middle: float | None
) -> tuple[LandmarkName, ...]:
    """Both nipples when they are exchanged; a single one beyond the midline, where this is known."""
    aside = {name: float(given[name][0]) for name in LANDMARK_NAMES[3:] if name in given}
    if len(aside) == 2:
        return tuple(aside) if aside["nipple_left"] <= aside["nipple_right"] else ()
    if middle is None:
        return ()
    return tuple(name for name, x in aside.items() if (x <= middle if name == "nipple_left" else x >= middle))


def _check_length(
    given: Mapping[LandmarkName, np.ndarray], expected: float | None, limits: LandmarkLimits
) -> tuple[float | None, list[Oddity]]:
    """The breastbone's length to measure with, and what is odd about the clicked one."""
    if not all(name in given for name in BONE_LANDMARKS):
        return expected, []
    length = float(given["suprasternal_notch"][1] - given["xiphisternum"][1])
    usual = expected or 100.0
    what = "bone_short" if length < usual else "bone_long"
    low, high = limits.length_anyone if expected is None else (n * expected for n in limits.length_refuse)
    if not low <= length <= high:
        return length, [Oddity(what, reasons.BREASTBONE_IMPLAUSIBLE, BONE_LANDMARKS, is_grave=True)]
    if expected is None or _within(length / expected, limits.length_care, _slack(expected, limits)):
        return length, []
    return length, [Oddity(what, reasons.BREASTBONE_UNUSUAL, BONE_LANDMARKS, is_grave=False)]


def _odd_shares(given: Mapping[LandmarkName, np.ndarray], length: float, limits: LandmarkLimits) -> list[Oddity]:
    slack = _slack(length, limits)
    found = []
    for what, names, share in _shares(given, length):
        refuse, care = getattr(limits, f"{what}_refuse"), getattr(limits, f"{what}_care")
        if not refuse[0] <= share <= refuse[1]:
            found.append(Oddity(what, reasons.LANDMARKS_IMPLAUSIBLE, names, is_grave=True))
        elif not _within(share, care, slack):
            found.append(Oddity(what, reasons.LANDMARKS_UNUSUAL, names, is_grave=False))
    return found


def _shares(
    given: Mapping[LandmarkName, np.ndarray], length: float
) -> list[tuple[str, tuple[LandmarkName, ...], float]]:
    """(what, between which points, how much in S) for each distance that can be measured."""
    shares: list[tuple[str, tuple[LandmarkName, ...], float]] = []
    notch = given.get("suprasternal_notch")
    nipples: tuple[LandmarkName, ...] = LANDMARK_NAMES[3:]
    if notch is not None and "navel" in given:
        shares.append(("navel", ("navel", "suprasternal_notch"), float(notch[1] - given["navel"][1]) / length))
    if all(name in given for name in nipples):
        middle = (given["nipple_left"][0] + given["nipple_right"][0]) / 2 if notch is None else notch[0]
        shares += [("nipple_aside", (name,), abs(float(given[name][0] - middle)) / length) for name in nipples]
        if notch is not None:
            shares += [("nipple_below", (name,), float(notch[1] - given[name][1]) / length) for name in nipples]
        elif "navel" in given:
            height = float((given["nipple_left"][1] + given["nipple_right"][1]) / 2 - given["navel"][1])
            shares.append(("nipples_to_navel", (*nipples, "navel"), height / length))
    return shares


def _slack(length: float, limits: LandmarkLimits) -> float:
    """By how much a click's error is a larger share of this breastbone than of an adult's."""
    return max(0.0, limits.click_mm / length - limits.click_mm / limits.adult_mm)


def _within(share: float, limits: tuple[float, float], slack: float) -> bool:
    return limits[0] - slack <= share <= limits[1] + slack
