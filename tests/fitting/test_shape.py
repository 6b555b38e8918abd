from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lubdub.fitting.expected import Span, anybody
from lubdub.fitting.refine import refine
from lubdub.fitting.shape import Pose, Pull, Target, carried, fit_shape, sternum_mm
from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface, carry
from lubdub.library.load import load_library
from lubdub.results import LANDMARK_NAMES, Library
from tests.scanned import clean_scan

FRONT = np.array([0.0, 0.0, 1.0])


@cache
def library() -> Library:
    return load_library()


def start(scale: float = 1.0) -> Pose:
    basis = library().basis
    notch = carry(basis.landmark_weights, basis.landmark_corners, basis.mean)[0]
    return Pose(Similarity(scale, np.eye(3), -scale * notch), anybody(basis).mean)


def pulls_of(reference_landmarks: dict) -> dict:
    return {name: Pull(place, 5.0) for name, place in reference_landmarks.items()}


@pytest.mark.parametrize("index", [0, 12, 25])
def test_a_body_of_the_same_family_is_found_again_from_one_noisy_side(index: int) -> None:
    reference = library().references[index]
    size = reference.landmarks["navel"][1] / -370.0
    target = Target.of(clean_scan(reference.surface, FRONT))
    _, fit = fit_shape(target, pulls_of(reference.landmarks), library().basis, start(size))
    assert fit.surface_residual_mm < 2.0
    assert fit.matched_share > 0.9
    length = -reference.landmarks["navel"][1]
    for name in LANDMARK_NAMES:  # skin slides along skin, most of all on a round belly
        assert np.linalg.norm(fit.landmarks[name] - reference.landmarks[name]) < 0.08 * length


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 1000))
def test_a_moved_scan_gives_the_moved_body(seed: int) -> None:
    reference = library().references[16]
    motion = Similarity(1.0, Rotation.random(random_state=seed).as_matrix(), np.array([50.0, -800.0, 20.0]))
    scan = clean_scan(reference.surface, FRONT, count=3000)
    basis, begin = library().basis, start()
    moved_start = Pose(motion.after(begin.body_from_basis), begin.coefficients)
    pulls = pulls_of(reference.landmarks)
    moved_pulls = {name: Pull(motion.apply(pull.position), pull.sigma_mm) for name, pull in pulls.items()}
    _, still = fit_shape(Target.of(scan), pulls, basis, begin)
    _, moved = fit_shape(Target.of(scan.moved(motion)), moved_pulls, basis, moved_start)
    assert np.abs(moved.surface.vertices - motion.apply(still.surface.vertices)).max() < 0.5


def test_the_order_of_the_scans_points_does_not_matter() -> None:
    reference = library().references[16]
    scan = clean_scan(reference.surface, FRONT, count=3000)
    order = np.random.default_rng(0).permutation(len(scan.points))
    shuffled = Target(scan.points[order], scan.normals[order], scan.is_border[order], Target.of(scan).tree)
    shuffled = Target.of(
        type(scan)(
            **{**vars(scan), "points": shuffled.points, "normals": shuffled.normals, "is_border": shuffled.is_border}
        )
    )
    pulls = pulls_of(reference.landmarks)
    _, first = fit_shape(Target.of(scan), pulls, library().basis, start())
    _, second = fit_shape(shuffled, pulls, library().basis, start())
    assert np.abs(first.surface.vertices - second.surface.vertices).max() < 0.1


def test_landmarks_alone_pull_the_body_when_there_is_no_skin_near() -> None:
    far = Target.of(clean_scan(Surface(library().references[0].surface.vertices + 5000, library().basis.triangles)))
    places = library().references[16].landmarks
    _, fit = fit_shape(far, pulls_of(places), library().basis, start(0.9))
    assert all(np.linalg.norm(fit.landmarks[name] - places[name]) < 12 for name in LANDMARK_NAMES)


def test_the_refinement_brings_the_body_closer_to_skin_and_clicks() -> None:
    reference = library().references[25]
    bump = 12 * np.exp(-(np.linalg.norm(reference.surface.vertices - reference.areas["mitral"], axis=1) ** 2) / 40**2)
    swollen = Surface(reference.surface.vertices + bump[:, None] * FRONT, reference.surface.triangles)
    target = Target.of(clean_scan(swollen, FRONT))
    basis, pulls = library().basis, pulls_of(reference.landmarks)
    _, fit = fit_shape(target, pulls, basis, start())
    finer = refine(fit, target, pulls, basis)

    def gap(surface: Surface) -> float:
        near = np.linalg.norm(swollen.vertices - reference.areas["mitral"], axis=1) < 40
        return float(np.linalg.norm(surface.vertices[near] - swollen.vertices[near], axis=1).mean())

    assert gap(finer.surface) < gap(fit.surface)
    assert np.linalg.norm(finer.landmarks["navel"] - reference.landmarks["navel"]) < 3


def test_an_expected_breastbone_draws_the_body_towards_its_length() -> None:
    reference = library().references[20]
    target = Target.of(clean_scan(reference.surface, FRONT, count=3000))
    _, free = fit_shape(target, {}, library().basis, start())
    for length in (0.8 * sternum_mm(free), 1.2 * sternum_mm(free)):
        of_length = replace(anybody(library().basis), sternum=Span(length, 3.0))
        _, drawn = fit_shape(target, {}, library().basis, start(), expected=of_length)
        assert abs(sternum_mm(drawn) - length) < abs(sternum_mm(free) - length)


def test_a_childs_mitral_area_is_carried_between_the_infants_and_the_adults() -> None:
    basis = library().basis
    body = Surface(basis.mean, basis.triangles)
    infant, child, adult = (carried(body, basis, share).areas["mitral"] for share in (1.0, 0.25, 0.0))
    assert np.allclose(child, 0.25 * infant + 0.75 * adult)
    assert infant[1] > adult[1]
