"""What a parent reads leads to the place: the numbers are read back and walked on the skin."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lubdub.areas.words import ENGLISH, FINGER_MM, Language, Person, instruction, measure
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.whereabouts import ABOVE_MM, Whereabouts, whereabouts
from tests import bodies

LENGTH = r"([\d.]+) cm \(about ([\d½]+) finger-widths?\)"
SENTENCE = re.compile(rf"Go {LENGTH} straight down along the skin(?:, then {LENGTH} to the patient's (left|right))?")


def skin_of(size: float) -> tuple[bodies.BodyScan, SkinCaster]:
    body = bodies.torso_scan(size=size, columns=90, rows=90)
    return body, SkinCaster(body.surface)


BODIES = {size: skin_of(size) for size in (0.28, 0.62, 1.0)}


def walk(skin: SkinCaster, start: np.ndarray, direction: tuple[float, float], length: float) -> np.ndarray:
    """Where one stands after going so far along the skin in a straight line, seen from the front. (3,)"""
    flat = np.arange(0.0, 2 * length + 1.0, 0.5)
    origins = np.column_stack([start[:2] + flat[:, None] * np.array(direction), np.full(len(flat), ABOVE_MM)])
    points = skin.cast(origins, np.array([0.0, 0.0, -1.0])).points
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.array([np.interp(length, gone, axis) for axis in points.T])


def in_mm(cm: str, fingers: str) -> tuple[float, float]:
    return 10 * float(cm), FINGER_MM * (int(fingers.rstrip("½") or 0) + 0.5 * fingers.endswith("½"))


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(BODIES)),
    st.floats(0.1, 0.95),
    st.floats(-0.62, 0.62),
)
def test_who_follows_the_sentence_arrives_within_its_rounding(size: float, down: float, across: float) -> None:
    body, skin = BODIES[size]
    notch, end = body.landmarks["suprasternal_notch"], body.landmarks["xiphisternum"]
    breadth = abs(body.landmarks["nipple_left"][0])
    above = np.array([notch[0] + across * 1.3 * breadth, notch[1] + down * (end[1] - notch[1]), ABOVE_MM])
    place = skin.hit(above, np.array([0.0, 0.0, -1.0]))
    assert place is not None
    said = SENTENCE.search(instruction(whereabouts(skin, place, notch)))
    assert said is not None
    down_cm, down_fingers, side_cm, side_fingers, side = said.groups()
    sign = 1.0 if side == "left" else -1.0
    for kind, rounding in ((0, 2.5), (1, FINGER_MM / 4)):
        below = walk(skin, notch, (0.0, -1.0), in_mm(down_cm, down_fingers)[kind])
        there = walk(skin, below, (sign, 0.0), in_mm(side_cm, side_fingers)[kind]) if side else below
        shortest = FINGER_MM / 2 - rounding  # less than half a finger is said as half a finger
        assert np.linalg.norm(there - place) <= np.hypot(rounding, rounding + (shortest if kind else 0)) + 2.0


@pytest.mark.parametrize("size", sorted(BODIES))
def test_the_sides_are_the_patients_own(size: float) -> None:
    body, skin = BODIES[size]
    notch = body.landmarks["suprasternal_notch"]
    said = {name: instruction(whereabouts(skin, place, notch)) for name, place in body.areas.items()}
    assert "patient's right" in said["aortic"]
    assert all("patient's left" in said[name] for name in ("pulmonary", "tricuspid", "mitral"))


def test_the_way_follows_the_skin_and_not_the_air() -> None:
    body, skin = BODIES[1.0]
    notch = body.landmarks["suprasternal_notch"]
    flank = skin.hit(np.array([135.0, -120.0, ABOVE_MM]), np.array([0.0, 0.0, -1.0]))
    assert flank is not None
    where = whereabouts(skin, flank, notch)
    assert where.left_mm > 135.0 + 5.0
    assert where.left_mm >= np.linalg.norm(flank - walk(skin, notch, (0.0, -1.0), where.down_mm))
    assert where.down_mm >= 120.0


def test_a_place_in_the_middle_has_no_side() -> None:
    assert "stay in the middle" in instruction(Whereabouts(60.0, 2.0))
    assert "stay in the middle" in instruction(Whereabouts(60.0, -2.0))


@pytest.mark.parametrize(
    ("mm", "words"),
    [
        (8.0, "1 cm (about ½ finger-width)"),
        (18.0, "2 cm (about 1 finger-width)"),
        (26.0, "2.5 cm (about 1½ finger-widths)"),
        (61.0, "6 cm (about 3½ finger-widths)"),
        (-61.0, "6 cm (about 3½ finger-widths)"),
    ],
)
def test_lengths_are_in_half_centimetres_and_half_fingers(mm: float, words: str) -> None:
    assert measure(mm) == words


@pytest.mark.parametrize(("person", "side"), [("child", "your child's left"), ("self", "your own left")])
def test_the_sentence_speaks_of_the_person_as_the_page_does(person: Person, side: str) -> None:
    assert side in instruction(Whereabouts(30.0, 30.0), ENGLISH, person)


def test_another_language_says_it_in_its_own_order_and_numbers() -> None:
    told = Language(
        lambda text: "A la izquierda {side}; antes, {down} abajo." if "left" in text else text,
        lambda one, many, count: "{distance} cm, {fingers} dedo" if count == 1 else "{distance} cm, {fingers} dedos",
        lambda value: f"{value:g}".replace(".", ","),
    )
    said = instruction(Whereabouts(55.0, 18.0), told, "child")
    assert said == "A la izquierda 2 cm, 1 dedo; antes, 5,5 cm, 3 dedos abajo."
