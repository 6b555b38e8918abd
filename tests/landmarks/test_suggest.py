from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from lubdub.geometry.surface import Surface
from lubdub.landmarks.suggest import suggest
from lubdub.library.load import load_library
from lubdub.results import LANDMARK_NAMES, CleanScan, Fit, Landmark, LandmarkName
from references.make.scan import Stage
from tests.bodies import torso_scan
from tests.scanned import clean_scan

FRONT = np.array([0.0, 0.0, 1.0])
BODY = torso_scan(breast=0.35)
SCAN = clean_scan(BODY.surface, FRONT, count=20000)
BODY_SKIN = Stage(BODY.surface)
SIGNS = load_library().signs
SOFT: tuple[LandmarkName, ...] = ("navel", "nipple_left", "nipple_right")
TOO_HIGH_MM = 18.0
"""A fitted body has its nipples so much above where people have them."""


def fitted(**off: np.ndarray) -> Fit:
    """A body that fits but for its nipples, and but for what is off, in mm."""
    landmarks = {name: place.copy() for name, place in BODY.landmarks.items()}
    for name in ("nipple_left", "nipple_right"):
        landmarks[name] += [0.0, TOO_HIGH_MM, 0.0]
    for name, offset in off.items():
        landmarks[name] += offset  # type: ignore[index]
    return Fit(BODY.surface, landmarks, {}, 1.0, 1.0, 0.5)


def suggested(fit: Fit, scan: CleanScan = SCAN) -> Mapping[LandmarkName, Landmark]:
    return suggest(scan, fit, np.ones(len(fit.surface.vertices)), SIGNS)


def off_mm(found: Mapping[LandmarkName, Landmark], name: LandmarkName) -> float:
    return float(np.linalg.norm(found[name].position - BODY.landmarks[name]))


def above_skin_mm(place: np.ndarray) -> float:
    return float(np.linalg.norm(BODY_SKIN.nearest(place[None])[0] - place))


def test_all_five_are_suggested_on_the_scanned_skin() -> None:
    found = suggested(fitted(suprasternal_notch=np.array([0.0, 0.0, 7.0])))
    assert set(found) == set(LANDMARK_NAMES)
    for mark in found.values():
        assert mark.source == "suggested"
        assert above_skin_mm(mark.position) < 3.0, "its points are 1 mm off it, one standard deviation"


def test_a_suggestion_does_not_jump_from_one_scanned_point_to_the_next() -> None:
    ups = np.arange(-6.0, 6.1, 0.5)
    places = [suggested(fitted(suprasternal_notch=np.array([0.0, up, 0.0])))["suprasternal_notch"] for up in ups]
    steps = np.diff([mark.position[1] for mark in places])
    assert 0.2 < steps.min() < steps.max() < 2.0, "points are 4 mm apart"


def test_where_nobody_scanned_the_skin_the_nearest_scanned_point_is_suggested() -> None:
    notch = BODY.landmarks["suprasternal_notch"]
    hole = np.linalg.norm(SCAN.points - notch, axis=1) > 25.0
    found = suggested(fitted(), replace(SCAN, points=SCAN.points[hole], normals=SCAN.normals[hole]))
    assert np.linalg.norm(SCAN.points[hole] - found["suprasternal_notch"].position, axis=1).min() == 0


def test_a_bone_that_floats_above_the_skin_is_less_sure() -> None:
    lift = np.array([0.0, 0.0, 25.0])
    close, floating = suggested(fitted()), suggested(fitted(suprasternal_notch=lift, xiphisternum=lift))
    for name in ("suprasternal_notch", "xiphisternum"):
        assert floating[name].uncertainty_mm > close[name].uncertainty_mm


def test_a_navel_is_found_where_its_dent_is_and_not_where_the_fitted_body_has_it() -> None:
    for up in (-15.0, 0.0, 15.0):
        assert off_mm(suggested(fitted(navel=np.array([0.0, up, 0.0]))), "navel") < 8.0


def test_nipples_follow_the_hills_of_the_breasts_and_not_the_fitted_body() -> None:
    """These bodies have the nipples a centimetre below the middle of their hills."""
    for up in (-15.0, 0.0, 15.0):
        found = suggested(fitted(nipple_left=np.array([6.0, up, 0.0]), nipple_right=np.array([-6.0, up, 0.0])))
        for name in ("nipple_left", "nipple_right"):
            hill = BODY.landmarks[name] + [0.0, 12.0, 0.0]
            assert np.linalg.norm((found[name].position - hill)[:2]) < 12.0
            assert off_mm(found, name) < 2 * found[name].uncertainty_mm


def test_a_mirrored_body_has_its_suggestions_mirrored_and_their_sides_swapped() -> None:
    flip = np.array([-1.0, 1.0, 1.0])
    swap = {"nipple_left": "nipple_right", "nipple_right": "nipple_left"}
    fit = fitted(nipple_left=np.array([6.0, 9.0, 0.0]), nipple_right=np.array([4.0, 9.0, 0.0]))
    mirror = Surface(fit.surface.vertices * flip, fit.surface.triangles[:, ::-1])
    places = {swap.get(name, name): place * flip for name, place in fit.landmarks.items()}
    scan = CleanScan(
        SCAN.points * flip, SCAN.normals * flip, SCAN.is_border, SCAN.drape, SCAN.body_from_file, SCAN.unit
    )
    found = suggested(fit)
    other = suggested(Fit(mirror, places, {}, 1.0, 1.0, 0.5), scan)  # type: ignore[arg-type]
    for name in ("nipple_left", "nipple_right"):
        np.testing.assert_allclose(other[swap[name]].position, found[name].position * flip, atol=0.1)  # type: ignore[index]
    np.testing.assert_allclose(other["navel"].position, found["navel"].position * flip, atol=2.0)


def test_the_skin_around_a_fitted_nipple_is_looked_at_however_little_its_dense_rings_tell_a_fit() -> None:
    fit = fitted()
    weight = np.ones(len(fit.surface.vertices))
    for name in ("nipple_left", "nipple_right"):
        weight[np.linalg.norm(fit.surface.vertices - fit.landmarks[name], axis=1) < 25.0] = 0.02
    for name, mark in suggest(SCAN, fit, weight, SIGNS).items():
        np.testing.assert_array_equal(mark.position, suggested(fit)[name].position)


def test_suggestions_move_with_the_body() -> None:
    shift = np.array([31.0, -17.0, 8.0])
    fit, move = fitted(), lambda points: points + shift
    moved = Fit(
        Surface(move(fit.surface.vertices), fit.surface.triangles),
        {name: move(place) for name, place in fit.landmarks.items()},
        {},
        1.0,
        1.0,
        0.5,
    )
    scan = CleanScan(move(SCAN.points), SCAN.normals, SCAN.is_border, SCAN.drape, SCAN.body_from_file, SCAN.unit)
    before, after = suggested(fit), suggested(moved, scan)
    for name in LANDMARK_NAMES:
        np.testing.assert_allclose(after[name].position, before[name].position + shift, atol=1e-6)
        assert after[name].uncertainty_mm == pytest.approx(before[name].uncertainty_mm)


def test_the_same_scan_has_the_same_suggestions_to_the_last_bit() -> None:
    one, two = suggested(fitted()), suggested(fitted())
    for name in LANDMARK_NAMES:
        assert one[name].position.tobytes() == two[name].position.tobytes()
        assert one[name].uncertainty_mm == two[name].uncertainty_mm


def smooth_barrel(noise_mm: float) -> tuple[CleanScan, Fit]:
    """The same body without breasts, nipples, belly and navel."""
    turn, up = np.meshgrid(np.linspace(-1.4, 1.4, 140), np.linspace(-480.0, 60.0, 150))
    points = np.stack([165 * np.sin(turn), up, 110 * np.cos(turn) - 60], axis=-1).reshape(-1, 3)
    normals = np.stack([np.sin(turn) / 165, 0 * turn, np.cos(turn) / 110], axis=-1).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = points + noise_mm * np.random.default_rng(3).normal(size=points.shape)
    scan = CleanScan(points, normals, np.zeros(len(points), bool), SCAN.drape, SCAN.body_from_file, SCAN.unit)
    surface = Surface(points[::20], np.array([[0, 1, 2]]))
    return scan, Fit(surface, fitted().landmarks, {}, 1.0, 1.0, 0.5)


@pytest.mark.parametrize("noise_mm", [0.5, 4.0])
def test_skin_without_marks_moves_a_suggestion_little_and_says_that_it_is_a_guess(noise_mm: float) -> None:
    scan, fit = smooth_barrel(noise_mm)
    found, clear = suggested(fit, scan), suggested(fitted())
    for name in SOFT:
        expected = fit.landmarks[name] - [0.0, 0.0 if name == "navel" else TOO_HIGH_MM, 0.0]
        assert np.linalg.norm((found[name].position - expected)[:2]) < 2 * found[name].uncertainty_mm
        assert found[name].uncertainty_mm > clear[name].uncertainty_mm


def test_a_scan_that_ends_above_the_navel_still_has_a_suggestion_for_it() -> None:
    kept = SCAN.points[:, 1] > -250.0
    scan = CleanScan(
        SCAN.points[kept], SCAN.normals[kept], SCAN.is_border[kept], SCAN.drape, SCAN.body_from_file, SCAN.unit
    )
    assert np.isfinite(suggested(fitted(), scan)["navel"].position).all()
