"""What is odd about points while they are still placed: what a run would say, and what the suggestions add."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lubdub.areas.anatomy import sternum_length_mm
from lubdub.landmarks import reasons
from lubdub.landmarks.check import Oddity as Oddity
from lubdub.landmarks.check import oddities, out_of_order
from lubdub.landmarks.frame import can_frame, frame_from_landmarks
from lubdub.results import LANDMARK_NAMES, Examination, LandmarkName, Landmarks, Patient, ScanRefused

FAR_SIGMAS = 4.0
"""A point this far from its suggestion is questioned: 1 right one in 100 at most."""

Points = Mapping[LandmarkName, np.ndarray]


def look_over(examination: Examination, in_file: Points, patient: Patient) -> tuple[Oddity, ...]:
    """What is odd about the points placed so far, the gravest first, each thing once.

    in_file: name -> (3,) in the file's own coordinates. What only the suggestions contradict is never grave.
    """
    placed = {name: examination.scan.body_from_file.apply(place) for name, place in in_file.items()}
    found = [*_among_themselves(examination, placed, patient), *_against_the_shape(placed, examination.suggested)]
    once: dict[str, Oddity] = {}
    for oddity in found:
        once.setdefault(oddity.what, oddity)
    if "order" in once:
        once.pop("sides", None)  # with head and belly swapped left and right seem swapped too
    return _led_by_the_far_one(sorted(once.values(), key=lambda oddity: not oddity.is_grave), found)


def _led_by_the_far_one(odd: list[Oddity], found: list[Oddity]) -> tuple[Oddity, ...]:
    """Where a single point is far from its suggestion, the impossible follows from that point: it is said first."""
    far = [oddity for oddity in found if oddity.what == "far"]
    if len(far) != 1 or not odd[0].is_grave or far[0].names[0] == odd[0].names[0]:
        return tuple(odd)
    return (replace(far[0], is_grave=True), *(oddity for oddity in odd if oddity.what != "far"))


def lies_clear(in_file: Points) -> bool:
    """Whether these points alone say which way a body lies: two different heights on its midline."""
    return can_frame(in_file)


def _among_themselves(examination: Examination, placed: Points, patient: Patient) -> tuple[Oddity, ...]:
    """What a run would say of them."""
    scan = examination.scan
    expected = None if patient.age_years is None else sternum_length_mm(patient.age_years, patient.sex)
    if not can_frame(placed):
        return ()
    try:
        move = frame_from_landmarks(placed, scan.points, scan.normals)
    except ScanRefused as refusal:
        are_swapped = refusal.reason == reasons.SIDES_SWAPPED
        what, names = ("sides", LANDMARK_NAMES[3:]) if are_swapped else ("apart", tuple(placed))
        return (Oddity(what, refusal.reason, names, is_grave=True),)
    return oddities(scan.moved(move), {name: move.apply(place) for name, place in placed.items()}, expected)


def _against_the_shape(placed: Points, suggested: Landmarks) -> list[Oddity]:
    """What contradicts the way the shape says the body lies. Nothing when the shape says nothing."""
    if not all(name in suggested for name in LANDMARK_NAMES):
        return []
    found = [replace(oddity, is_grave=False) for oddity in out_of_order(placed)]
    middle = suggested["suprasternal_notch"].position[0]
    sides: tuple[tuple[LandmarkName, float], ...] = (("nipple_left", 1.0), ("nipple_right", -1.0))
    for name, sign in sides:
        if name in placed and sign * (placed[name][0] - middle) < 0:
            found.append(Oddity("sides", reasons.SIDES_SWAPPED, (name,), is_grave=False))
    for name, place in placed.items():
        guess = suggested[name]
        if np.linalg.norm(place - guess.position) > FAR_SIGMAS * guess.uncertainty_mm:
            found.append(Oddity("far", reasons.FAR_FROM_GUESS, (name,), is_grave=False))
    return found
