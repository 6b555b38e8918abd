"""Colours bring suggested nipples and navel nearer where they show something, and change nothing where they do not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.geometry.colour import Tint
from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.landmarks.suggest import suggest
from lubdub.library.load import load_library
from lubdub.results import CleanScan, Fit, Landmark, LandmarkName
from references.make.paint import Complexion, Patch, Shadow
from tests.bodies import torso_scan
from tests.scanned import clean_scan

BODY = torso_scan(breast=0.35)
SCAN = clean_scan(BODY.surface, np.array([0.0, 0.0, 1.0]), count=20000)
SIGNS = load_library().signs
NIPPLES: tuple[LandmarkName, ...] = ("nipple_left", "nipple_right")
SOFT: tuple[LandmarkName, ...] = ("navel", *NIPPLES)
FIT = Fit(
    BODY.surface,
    {name: place + [0.0, 18.0 if name in NIPPLES else 0.0, 0.0] for name, place in BODY.landmarks.items()},
    {},
    1.0,
    1.0,
    0.5,
)
TONES = {"dark": 0.2, "middle": 0.5, "light": 0.8}
RED, BROWN = np.array([0.8, 0.6, 0.6]), np.array([0.4, 0.3, 0.25])


def patch(middle: np.ndarray, radius: float, tone: np.ndarray) -> Patch:
    return Patch(middle, radius, tone, 0.3, np.zeros((4, 3)))


def areolas(light: float = 0.5, names: tuple[LandmarkName, ...] = NIPPLES) -> tuple[Patch, ...]:
    return tuple(patch(BODY.landmarks[name], 14.0, skin(light) * RED) for name in names)


def skin(light: float) -> np.ndarray:
    return light * np.array([1.0, 0.74, 0.58])


def painted(patches: tuple[Patch, ...] = (), light: float = 0.5, shadow: Shadow | None = None) -> Tint:
    """Blotchy skin with patches, as a camera sees it."""
    random = np.random.default_rng(4)
    waves = random.normal(size=(24, 4)) * [0.05, 0.05, 0.05, 2.0]
    whole = Complexion(skin(light), waves, np.zeros((0, 4)), np.zeros((0, 3)), patches=patches, shadow=shadow)
    colours = whole.colours(SCAN.points) ** (1 / 1.6) + random.normal(size=SCAN.points.shape) * 0.01
    return Tint(SCAN.points, np.clip(255 * colours, 0, 255).astype(np.float32))


def suggested(tint: Tint | None, scan: CleanScan = SCAN, fit: Fit = FIT) -> Mapping[LandmarkName, Landmark]:
    return suggest(scan, fit, np.ones(len(fit.surface.vertices)), SIGNS, tint)


def off_mm(found: Mapping[LandmarkName, Landmark], name: LandmarkName) -> float:
    return float(np.linalg.norm(found[name].position - BODY.landmarks[name]))


def moved_mm(one: Mapping[LandmarkName, Landmark], other: Mapping[LandmarkName, Landmark], name: LandmarkName) -> float:
    return float(np.linalg.norm(one[name].position - other[name].position))


@pytest.mark.parametrize("light", TONES.values(), ids=TONES)
def test_on_every_tone_of_skin_areolas_bring_the_nipples_within_a_few_millimetres(light: float) -> None:
    found, by_shape = suggested(painted(areolas(light), light)), suggested(None)
    for name in NIPPLES:
        assert off_mm(found, name) < 4.0 < off_mm(by_shape, name)
        assert off_mm(found, name) < found[name].uncertainty_mm < 0.8 * by_shape[name].uncertainty_mm


def test_a_darker_navel_is_found_where_it_is() -> None:
    fit = replace(FIT, landmarks={**FIT.landmarks, "navel": BODY.landmarks["navel"] + [0.0, 20.0, 0.0]})
    found = suggested(painted((patch(BODY.landmarks["navel"], 7.0, skin(0.5) * RED),)), fit=fit)
    assert off_mm(found, "navel") < 4.0
    assert found["navel"].uncertainty_mm < suggested(None, fit=fit)["navel"].uncertainty_mm


def test_where_one_areola_does_not_show_the_other_still_does_and_is_surer() -> None:
    one, by_shape = suggested(painted(areolas(names=("nipple_left",)))), suggested(None)
    assert off_mm(one, "nipple_left") < off_mm(by_shape, "nipple_left") / 1.5
    assert off_mm(one, "nipple_right") < off_mm(by_shape, "nipple_right")
    assert one["nipple_left"].uncertainty_mm < 0.7 * one["nipple_right"].uncertainty_mm


def test_skin_whose_colour_shows_nothing_is_no_reason_to_be_surer() -> None:
    bare, by_shape = suggested(painted()), suggested(None)
    for name in SOFT:
        assert bare[name].uncertainty_mm > 0.9 * by_shape[name].uncertainty_mm
        assert moved_mm(bare, by_shape, name) < 6.0


USELESS = {
    "grey": lambda tint: np.repeat(tint.colours.mean(axis=1, keepdims=True), 3, axis=1),
    "overexposed": lambda tint: np.full_like(tint.colours, 255.0),
    "black": lambda tint: np.zeros_like(tint.colours),
}


@pytest.mark.parametrize("how", USELESS)
def test_colours_without_colour_change_nothing_to_the_last_bit(how: str) -> None:
    tint = painted(areolas())
    found, by_shape = suggested(replace(tint, colours=USELESS[how](tint))), suggested(None)
    for name in SOFT:
        assert found[name].position.tobytes() == by_shape[name].position.tobytes()
        assert found[name].uncertainty_mm == by_shape[name].uncertainty_mm


@pytest.mark.parametrize(("out", "up"), [(30.0, 30.0), (-35.0, 0.0), (20.0, -40.0)])
def test_a_mole_alone_moves_nothing_far(out: float, up: float) -> None:
    x, y = (BODY.landmarks["nipple_left"] + [out, up, 0.0])[:2]
    place = SCAN.points[np.hypot(SCAN.points[:, 0] - x, SCAN.points[:, 1] - y).argmin()]
    found, bare = suggested(painted((patch(place, 4.0, 0.5 * BROWN),))), suggested(painted())
    for name in NIPPLES:
        assert moved_mm(found, bare, name) < 8.0


def test_beside_areolas_a_large_mole_moves_nothing() -> None:
    place = BODY.landmarks["nipple_left"] + [25.0, 25.0, 0.0]
    mole = patch(SCAN.points[np.linalg.norm(SCAN.points - place, axis=1).argmin()], 6.0, 0.5 * BROWN)
    found = suggested(painted((*areolas(), mole)))
    assert all(off_mm(found, name) < 4.0 for name in NIPPLES)


def test_the_edge_of_a_shadow_is_no_areola() -> None:
    bare, surer = suggested(painted()), []
    for turn in np.arange(0.0, 2 * np.pi, 0.8):
        across = np.array([np.cos(turn), np.sin(turn), 0.0])
        shadow = Shadow(BODY.landmarks["nipple_left"] + 15.0 * across, across, 0.6, 3.0)
        found = suggested(painted(shadow=shadow))
        surer.append(bare["nipple_left"].uncertainty_mm / found["nipple_left"].uncertainty_mm)
        assert moved_mm(found, bare, "nipple_left") < 0.6 * bare["nipple_left"].uncertainty_mm
        assert off_mm(suggested(painted(areolas(), shadow=shadow)), "nipple_left") < 5.0
    assert max(surer) < 1.2, "blotches do as much"
    assert np.mean(surer) < 1.0


def test_where_the_fit_is_nearly_right_no_shadow_makes_a_nipple_a_tenth_surer() -> None:
    near = replace(FIT, landmarks={**BODY.landmarks, **{n: BODY.landmarks[n] + [0.0, 9.0, 0.0] for n in NIPPLES}})
    bare = suggested(painted(), fit=near)["nipple_left"].uncertainty_mm
    for turn in (0.0, 0.8, 1.6):
        across = np.array([np.cos(turn), np.sin(turn), 0.0])
        shadow = Shadow(BODY.landmarks["nipple_left"] + 15.0 * across, across, 0.6, 3.0)
        assert suggested(painted(shadow=shadow), fit=near)["nipple_left"].uncertainty_mm > 0.9 * bare


def test_a_mirrored_coloured_body_has_its_suggestions_mirrored() -> None:
    flip, swap = np.array([-1.0, 1.0, 1.0]), {"nipple_left": "nipple_right", "nipple_right": "nipple_left"}
    tint = painted((*areolas(), patch(BODY.landmarks["nipple_left"] + [20.0, 25.0, -5.0], 6.0, 0.5 * BROWN)))
    places = {swap.get(name, name): place * flip for name, place in FIT.landmarks.items()}
    mirror = Surface(FIT.surface.vertices * flip, FIT.surface.triangles[:, ::-1])
    scan = replace(SCAN, points=SCAN.points * flip, normals=SCAN.normals * flip)
    found = suggested(tint)
    other = suggested(Tint(tint.points * flip, tint.colours), scan, replace(FIT, surface=mirror, landmarks=places))  # type: ignore[arg-type]
    for name in NIPPLES:
        np.testing.assert_allclose(other[swap[name]].position, found[name].position * flip, atol=0.1)  # type: ignore[index]
        assert other[swap[name]].uncertainty_mm == pytest.approx(found[name].uncertainty_mm, rel=1e-3)  # type: ignore[index]


def test_how_the_file_lies_changes_nothing() -> None:
    tint = painted(areolas())
    motion = Similarity(0.001, Rotation.random(random_state=3).as_matrix(), np.array([0.4, -0.2, 0.9]))
    lying = Tint(motion.apply(tint.points), tint.colours)
    here, there = suggested(tint), suggested(lying, replace(SCAN, body_from_file=motion.inverse()))
    for name in SOFT:
        np.testing.assert_allclose(there[name].position, here[name].position, atol=1e-6)
        assert there[name].uncertainty_mm == pytest.approx(here[name].uncertainty_mm)


def test_coloured_things_away_from_the_skin_tell_nothing() -> None:
    tint = painted(areolas())
    lifted = Tint(tint.points + [0.0, 0.0, 60.0], tint.colours)
    found, by_shape = suggested(lifted), suggested(None)
    assert all(found[name].position.tobytes() == by_shape[name].position.tobytes() for name in SOFT)
