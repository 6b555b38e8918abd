"""Simulated people: the truth goes wherever the skin goes, and the same seed is the same file."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lubdub.fitting.shape import carried
from lubdub.geometry.anchors import Anchors
from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Fit
from lubdub.scans.read import read_scan
from references.make.basis import with_marks_in_place
from references.make.cameras import SCANNERS, Scene
from references.make.moment import Moment, breathe, draw_moment, raised_bed, tilted
from references.make.scan import Stage
from tests.benchmark import cohort
from tests.benchmark.cohort import (
    GROUPS,
    Places,
    cohort_case,
    lay,
    scanner_of,
)
from tests.benchmark.measure import Case

STILL = Moment()
MOVED = Moment(breath_mm=6.0, roll_deg=4.0, pitch_deg=-3.0, raised_deg=20.0)


def laid(moment: Moment) -> tuple[Scene, Places]:
    return lay(cohort.draw_person(5, 6)[0], np.random.default_rng(1), moment)


@pytest.fixture(scope="module", params=[STILL, MOVED], ids=["still", "moved"])
def scene_and_places(request) -> tuple[Scene, Places]:
    return laid(request.param)


def test_every_place_lies_on_the_skin_however_it_is_bent(scene_and_places) -> None:
    scene, places = scene_and_places
    for points in vars(places).values():
        np.testing.assert_allclose(Stage(scene.people).nearest(points), points, atol=0.2)


@pytest.fixture(scope="module")
def average() -> Fit:
    basis = load_library().basis
    return carried(Surface(basis.mean, basis.triangles), basis)


def areas_between(average: Fit, landmarks: np.ndarray) -> np.ndarray:
    return cohort.areas_carried_by(average.surface.vertices, landmarks, load_library().basis)


def test_the_average_body_carries_its_own_areas_where_they_are(average: Fit) -> None:
    found = areas_between(average, np.array(list(average.landmarks.values())))
    np.testing.assert_allclose(found, list(average.areas.values()), atol=0.5)


def test_carried_areas_go_with_bones_that_lie_higher_under_the_same_skin(average: Fit) -> None:
    landmarks = np.array(list(average.landmarks.values()))
    landmarks[:2, 1] += 10.0
    moved = areas_between(average, landmarks) - list(average.areas.values())
    np.testing.assert_allclose(moved[:, 0], 0.0, atol=2.0)
    assert (moved[:3, 1] > 6.0).all(), "the apex also heeds the nipple, which stayed"


@pytest.mark.parametrize("name", ["girl-04-chubby", "man-25", "woman-33-large-breasts"])
def test_skin_slid_until_all_marks_are_in_place_is_still_the_same_skin(name: str) -> None:
    library, known = load_library(), cohort.workshop().torso
    torso = replace(known, trunk=np.where(known.trunk > 0, 1.0, 0.0))
    (body,) = (one for one in library.references if one.id == name)
    landmarks = np.array([body.landmarks[one] for one in LANDMARK_NAMES])
    marks = Anchors(library.basis.landmark_corners, library.basis.landmark_weights)
    slid = with_marks_in_place(torso, body.surface.vertices, landmarks, marks)
    np.testing.assert_allclose(marks.on(slid), landmarks, atol=1.0)
    off = np.linalg.norm(Stage(body.surface).nearest(slid) - slid, axis=1)
    assert off.max() < 0.01


def test_truth_keeps_its_distances_along_the_chest_when_the_bed_is_raised() -> None:
    flat, raised = (laid(Moment(raised_deg=degrees))[1] for degrees in (0.0, 20.0))
    for one, other in ((flat.areas, raised.areas), (flat.landmarks[:2], raised.landmarks[:2])):
        gaps = [np.linalg.norm(points[:, None] - points[None], axis=-1) for points in (one, other)]
        np.testing.assert_allclose(*gaps, atol=0.5)


def test_a_raised_head_end_lifts_the_notch_and_leaves_the_hips() -> None:
    bed = raised_bed(-100.0, 150.0, 20.0)
    points = np.array([[0.0, 0.0, 50.0], [0.0, -700.0, 50.0]])
    bent = bed.bent(points)
    assert bent[0, 2] > points[0, 2] + 100
    np.testing.assert_allclose(bent[1], points[1], atol=1e-9)


@given(st.floats(-700.0, 300.0), st.floats(0.0, 25.0))
def test_the_mattress_is_bent_without_being_stretched(y: float, degrees: float) -> None:
    bed = raised_bed(-100.0, 150.0, degrees)
    ends = bed.bent(np.array([[0.0, y, -100.0], [0.0, y + 0.5, -100.0]]))
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(0.5, rel=1e-3)


def test_breath_lifts_the_areas_with_the_chest_and_spares_the_arms() -> None:
    subject, _ = cohort.draw_person(5, 3)
    torso = cohort.workshop().torso
    rise = breathe(torso, subject.whole, subject.sternum_mm, 6.0) - subject.whole
    vertices = subject.whole[torso.indices]
    near = np.linalg.norm(vertices - subject.areas[2], axis=1).argsort()[:5]
    assert rise[torso.indices[near], 2] == pytest.approx(6.0, abs=1.0)
    assert (rise[torso.indices[near], 1] > 0).all()
    assert np.abs(rise[torso.indices[torso.trunk == 0]]).max() == 0.0


def test_breath_out_sinks_what_breath_in_lifts() -> None:
    down, up = (laid(Moment(breath_mm=breath))[1].areas for breath in (-4.0, 6.0))
    assert (up - down)[:, 2] == pytest.approx(10.0, abs=5.0)


def test_a_left_side_up_roll_lifts_the_left_and_head_up_pitch_the_head() -> None:
    points = np.array([[100.0, 0.0, 0.0], [0.0, 100.0, 0.0]])
    assert tilted(points, Moment(roll_deg=5.0))[0, 2] > 5
    assert tilted(points, Moment(pitch_deg=5.0))[1, 2] > 5


@given(st.integers(0, 10_000), st.floats(0.3, 1.1))
def test_moments_stay_in_their_stated_ranges(seed: int, size: float) -> None:
    moment = draw_moment(np.random.default_rng(seed), size)
    assert -4.0 * size <= moment.breath_mm <= 6.0 * size
    assert 0.0 <= moment.raised_deg <= 20.0


@pytest.mark.parametrize("number", range(len(SCANNERS)))
def test_the_same_seed_and_number_give_the_same_bytes(number: int) -> None:
    one, two = cohort_case(3, number), cohort_case(3, number)
    assert one.data == two.data
    assert one.camera == scanner_of(number)
    for name in AREA_NAMES:
        np.testing.assert_array_equal(one.areas[name], two.areas[name])


def in_body(case: Case, points: dict) -> np.ndarray:
    """(k, k) distances between places in mm: what does not depend on the file's axes."""
    places = np.array(list(points.values())) * case.mm_per_unit
    return np.linalg.norm(places[:, None] - places[None], axis=-1)


def test_another_scan_of_a_person_has_the_same_bones_but_other_noise() -> None:
    one, two = cohort_case(3, 1), cohort_case(3, 1, scan=1)
    assert one.data != two.data
    np.testing.assert_allclose(in_body(one, dict(one.areas)), in_body(two, dict(two.areas)), atol=6.0)
    assert np.abs(in_body(one, dict(one.clicks)) - in_body(two, dict(two.clicks))).max() > 1.0


@pytest.mark.parametrize("scanner", SCANNERS)
def test_the_truth_lies_on_every_scanners_own_skin_within_its_errors(scanner: str) -> None:
    case = cohort_case(3, 3, scanner=scanner)
    points = read_scan(case.data).surface.vertices
    for name in LANDMARK_NAMES:
        gap = np.linalg.norm(points - case.landmarks[name], axis=1).min() * case.mm_per_unit
        assert gap < 12.0


def test_a_click_where_no_skin_faces_the_front_lands_on_the_nearest_skin() -> None:
    workshop, (subject, _) = cohort.workshop(), cohort.draw_person(5, 3)
    above = subject.landmarks[0] + [0.0, 400.0, 0.0]
    place = cohort._on_skin(above, subject.whole[workshop.torso.indices], workshop.torso.triangles)
    assert Stage(Surface(subject.whole, workshop.torso.triangles)).nearest(place[None])[0] == pytest.approx(place)


def test_every_group_meets_every_scanner() -> None:
    count = len(GROUPS) * len(SCANNERS)
    met = {(number % len(GROUPS), scanner_of(number)) for number in range(count)}
    assert len(met) == count
