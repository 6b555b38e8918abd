import numpy as np
import pytest

from lubdub.fitting.nonrigid import BendStep
from lubdub.fitting.paper import fit_paper, front_of
from lubdub.fitting.schedule import FAITHFUL, PAPER
from lubdub.geometry.frames import Similarity
from lubdub.results import AREA_NAMES, CleanScan, Fit, Landmarks, Reference, ScanRefused
from tests.bodies import Shape, areas_of, landmarks_of
from tests.overlays import STILL, clean_scan, clicked, motion, reference_of, seen_from_front

BODY = Shape(breast=0.3, belly=0.5, breadth=1.05)
LIKE_IT = Shape(breast=0.2, belly=0.3)


@pytest.fixture(scope="module")
def scan() -> CleanScan:
    return clean_scan(seen_from_front(BODY), noise_mm=1.0)


@pytest.fixture(scope="module")
def reference() -> Reference:
    return reference_of("like it", LIKE_IT)


@pytest.fixture(scope="module")
def fit(scan: CleanScan, reference: Reference) -> Fit:
    return fit_paper(scan, clicked(BODY), reference, STILL)


def errors(fit: Fit, truth: dict) -> np.ndarray:
    return np.array([np.linalg.norm(fit.areas[name] - truth[name]) for name in AREA_NAMES])


def test_the_areas_land_where_they_are_on_this_body(fit: Fit) -> None:
    assert errors(fit, areas_of(BODY)).max() < 10
    assert errors(fit, areas_of(BODY)).mean() < 5


def test_the_landmarks_land_too(fit: Fit) -> None:
    for name, place in landmarks_of(BODY).items():
        assert np.linalg.norm(fit.landmarks[name] - place) < 12


def test_the_fit_says_how_well_it_lies_and_every_step(fit: Fit) -> None:
    assert fit.surface_residual_mm < 3
    assert fit.matched_share > 0.95
    assert fit.steps[0]["alpha"] == 50
    assert fit.steps[-1]["alpha"] == 0.2


def test_every_step_is_told_while_it_happens(scan: CleanScan, reference: Reference) -> None:
    heard: list[BendStep] = []
    told = fit_paper(scan, clicked(BODY), reference, STILL, on_step=heard.append)
    assert [step.numbers() for step in heard] == list(told.steps)


def test_a_reference_in_its_own_place_is_brought_over_by_the_start(scan: CleanScan, fit: Fit) -> None:
    away = motion(100, (0, 0, 1), (500, 0, 0))
    elsewhere = Reference(
        "elsewhere",
        type(fit.surface)(
            away.apply(reference_of("x", LIKE_IT).surface.vertices), reference_of("x", LIKE_IT).surface.triangles
        ),
        {name: away.apply(place) for name, place in landmarks_of(LIKE_IT).items()},
        {name: away.apply(place) for name, place in areas_of(LIKE_IT).items()},
        {},
    )
    again = fit_paper(scan, clicked(BODY), elsewhere, away.inverse())
    assert np.allclose(again.surface.vertices, fit.surface.vertices, atol=0.1)
    assert errors(again, dict(fit.areas)).max() < 0.1


@pytest.mark.parametrize("missing", [("navel",), ("nipple_left", "nipple_right"), tuple(landmarks_of(BODY))])
def test_missing_landmarks_do_not_stop_it(scan: CleanScan, reference: Reference, missing: tuple[str, ...]) -> None:
    some: Landmarks = {name: mark for name, mark in clicked(BODY).items() if name not in missing}
    assert errors(fit_paper(scan, some, reference, STILL), areas_of(BODY)).max() < 15


def test_a_reference_that_lies_nowhere_near_is_refused_in_words(scan: CleanScan, reference: Reference) -> None:
    with pytest.raises(ScanRefused) as refused:
        fit_paper(scan, clicked(BODY), reference, Similarity(1.0, np.eye(3), np.array([9000.0, 0, 0])))
    assert refused.value.reason.code == "no_overlap"
    assert refused.value.reason.advice


def test_the_source_has_about_as_many_vertices_as_asked_for(reference: Reference) -> None:
    assert len(front_of(reference, PAPER.source_vertices).vertices) == pytest.approx(4500, rel=0.3)
    assert len(front_of(reference, FAITHFUL.source_vertices).vertices) == pytest.approx(25_000, rel=0.3)
