"""Metres, centimetres or millimetres? Found from how large people are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lubdub.geometry.frames import MM_PER_UNIT
from lubdub.results import LandmarkName, RawScan, ScanRefused, Unit
from lubdub.scans.reasons import MARKS_IMPLAUSIBLE, UNIT_IMPLAUSIBLE, UNIT_WRONG, unreadable

Source = Literal["given", "found"]


@dataclass(frozen=True)
class SizeLimits:
    """What people measure, newborn to very large adult, in millimetres."""

    notch_to_navel: tuple[float, float] = (75.0, 620.0)
    """2.2-2.7 sternum lengths; the sternum is about 45 mm in a small newborn and 200 mm in a very tall man."""
    nipples_to_navel: tuple[float, float] = (50.0, 480.0)
    nipple_to_nipple: tuple[float, float] = (50.0, 460.0)
    """75 mm in a newborn; 0.4-0.75 sternum lengths to each side in adults, more in large breasts lying down."""
    notch_to_xiphisternum: tuple[float, float] = (32.0, 270.0)
    length_found: tuple[float, float] = (95.0, 2500.0)
    """Longest side of a scan whose unit nobody stated: a newborn's belly to an adult with a bed around."""
    trunk_length: float = 150.0
    """A newborn's trunk is longer than this, from neck to hip."""
    length_stated: tuple[float, float] = (100.0, 4000.0)
    """The same when the unit was stated: a cropped newborn to a whole small room."""
    compact_middle: float = 0.4
    """A trunk alone is at least 0.4 as broad as it is long; a person from head to foot is not (about 0.3)."""
    compact_depth: float = 0.26
    """And 0.26 as deep as it is broad, a broad newborn seen from one side 0.27; a person on a bed is not (0.1-0.25)."""
    short_compact_depth: float = 0.3
    """The same below a newborn trunk's length, where a very large adult cropped on a bed reaches 0.27."""


LIMITS = SizeLimits()
_SAMPLE = 20_000
_TRIM = 1.0  # percent at either end: stray points lie there


def find_unit(raw: RawScan, given: str | None, landmarks: Mapping[LandmarkName, np.ndarray]) -> Unit:
    """The unit of a file's coordinates.

    given: m, cm, mm, or None when nobody said; landmarks: name -> (3,) in the file's coordinates, may be
    empty. Order of trust: what was said, distances between landmarks, the format's own unit, the scan's size.
    Raises ScanUnreadable for a unit that we do not know, and ScanRefused when the body would be impossible, when
    more than one unit would do, or when the landmarks fit no person though the scan does.
    """
    if given is not None and given not in MM_PER_UNIT:
        raise unreadable("bad_unit")
    distances = _landmark_distances(landmarks)
    sides = _robust_sides(raw.surface.vertices)
    by_marks = _fitting_landmarks(distances)
    if given is not None:
        if not _is_possible(given, distances, sides):
            is_a_body = not by_marks and _is_possible(given, {}, sides)
            raise ScanRefused(MARKS_IMPLAUSIBLE if is_a_body else UNIT_WRONG)
        return _unit(given, "given")
    if distances:
        if not by_marks and _fitting_size(sides):
            raise ScanRefused(MARKS_IMPLAUSIBLE)
        return _only(by_marks)
    if raw.unit_by_format and _is_possible(raw.unit_by_format, distances, sides):
        return _unit(raw.unit_by_format, "found")
    return _only(_fitting_size(sides))


def _unit(name: str, source: Source) -> Unit:
    return Unit(name, MM_PER_UNIT[name], source)


def _only(candidates: list[str]) -> Unit:
    if len(candidates) != 1:
        raise ScanRefused(UNIT_IMPLAUSIBLE)
    return _unit(candidates[0], "found")


def _landmark_distances(landmarks: Mapping[LandmarkName, np.ndarray]) -> dict[str, float]:
    """Field of SizeLimits -> distance in file units, for every pair of landmarks that is there."""
    places: dict[str, np.ndarray] = {name: np.asarray(place, float) for name, place in landmarks.items()}
    if "nipple_left" in places and "nipple_right" in places:
        places["nipples"] = (places["nipple_left"] + places["nipple_right"]) / 2
    pairs = {
        "notch_to_navel": ("suprasternal_notch", "navel"),
        "nipples_to_navel": ("nipples", "navel"),
        "nipple_to_nipple": ("nipple_left", "nipple_right"),
        "notch_to_xiphisternum": ("suprasternal_notch", "xiphisternum"),
    }
    return {
        name: float(np.linalg.norm(places[first] - places[second]))
        for name, (first, second) in pairs.items()
        if first in places and second in places
    }


def _robust_sides(vertices: np.ndarray) -> np.ndarray:
    """(3,) lengths along the principal axes, longest first, in file units, without the outermost percent."""
    step = max(len(vertices) // _SAMPLE, 1)
    sample = vertices[::step] - np.median(vertices[::step], axis=0)
    near = np.linalg.norm(sample, axis=1)
    sample = sample[near <= 3 * np.median(near) + 1e-12]
    _, axes = np.linalg.eigh(sample.T @ sample)
    low, high = np.percentile(sample @ axes, (_TRIM, 100 - _TRIM), axis=0)
    return np.asarray(np.sort(high - low)[::-1])


def _fits(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def _fitting_landmarks(distances: Mapping[str, float]) -> list[str]:
    return [
        name
        for name, mm in MM_PER_UNIT.items()
        if all(_fits(distance * mm, getattr(LIMITS, pair)) for pair, distance in distances.items())
    ]


def _fitting_size(sides: np.ndarray) -> list[str]:
    """Units in which the scan is as long as scans of people are.

    From 95 to 250 a file may hold a newborn in millimetres or a grown person in centimetres. A trunk is
    compact, a person with legs or a bed is long or flat; below a trunk's length both remain possible.
    """
    names = [name for name, mm in MM_PER_UNIT.items() if _fits(sides[0] * mm, LIMITS.length_found)]
    if names == ["cm", "mm"]:
        is_long = sides[0] >= LIMITS.trunk_length
        deep = LIMITS.compact_depth if is_long else LIMITS.short_compact_depth
        is_compact = sides[1] >= LIMITS.compact_middle * sides[0] and sides[2] >= deep * sides[1]
        if not is_compact:
            return ["cm"]
        return ["mm"] if is_long else names
    return names


def _is_possible(name: str, distances: Mapping[str, float], sides: np.ndarray) -> bool:
    if distances:
        return name in _fitting_landmarks(distances)
    return _fits(sides[0] * MM_PER_UNIT[name], LIMITS.length_stated)
