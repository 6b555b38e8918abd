"""Several sizes to start from, and the end that explains the scan."""

from __future__ import annotations

import numpy as np
import pytest

from lubdub.fitting.shape import Pull, Span, Target, body_of, carried, fit_shape, sternum_mm
from lubdub.fitting.starts import SETTINGS, best_end, ended, sized_starts, start_from
from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from lubdub.results import LandmarkName
from tests.bodies import hide_side, torso_scan
from tests.scanned import clean_scan

BASIS = load_library().basis
SEEN: tuple[LandmarkName, ...] = ("navel", "nipple_left", "nipple_right")
SCAN = hide_side(torso_scan())
MIDDLE = np.mean([SCAN.landmarks[name] for name in SEEN], axis=0)
TARGET = Target.of(clean_scan(SCAN.surface, np.array([0.0, 0.0, 1.0])))
PULLS = {name: Pull(SCAN.landmarks[name], 10.0) for name in SEEN}


def test_landmarks_place_and_size_a_start() -> None:
    places = {name: SCAN.landmarks[name] for name in SEEN}
    grown = {name: 1.2 * place + 7.0 for name, place in places.items()}
    once, larger = (start_from(these, BASIS).body_from_basis for these in (places, grown))
    assert larger.scale == pytest.approx(1.2 * once.scale)
    assert np.allclose(larger.translation, 1.2 * once.translation + 7.0)


def test_starts_of_all_sizes_agree_about_their_middle() -> None:
    start = start_from({name: SCAN.landmarks[name] for name in SEEN}, BASIS)
    in_basis = start.body_from_basis.inverse().apply(MIDDLE)
    starts = sized_starts(start, MIDDLE, BASIS, Span(180.0, 20.0))
    assert len(starts) == len(SETTINGS.sizes) + len(SETTINGS.expected_sizes)
    for one in starts:
        assert np.allclose(one.body_from_basis.apply(in_basis), MIDDLE)


def test_a_start_of_the_expected_size_has_the_expected_breastbone() -> None:
    start = start_from({name: SCAN.landmarks[name] for name in SEEN}, BASIS)
    expected = sized_starts(start, MIDDLE, BASIS, Span(123.0, 20.0))[len(SETTINGS.sizes)]
    body = carried(Surface(body_of(expected, BASIS), BASIS.triangles), BASIS)
    assert sternum_mm(body) == pytest.approx(123.0)


def test_no_start_ends_worse_than_the_best_end() -> None:
    start = start_from({name: SCAN.landmarks[name] for name in SEEN}, BASIS)
    starts = sized_starts(start, MIDDLE, BASIS, None)
    best = best_end(TARGET, PULLS, BASIS, starts)
    alone = [best_end(TARGET, PULLS, BASIS, [one]).misfit_mm for one in starts]
    assert best.misfit_mm == min(alone)


@pytest.mark.parametrize("off_mm", [-40.0, 40.0])
def test_an_unexpected_size_counts_against_an_end(off_mm: float) -> None:
    pose, fit = fit_shape(TARGET, PULLS, BASIS, start_from({name: SCAN.landmarks[name] for name in SEEN}, BASIS))

    def misfit_mm(expected_mm: float) -> float:
        return ended(pose, fit, BASIS, TARGET, Span(expected_mm, 20.0)).misfit_mm

    assert misfit_mm(sternum_mm(fit)) == ended(pose, fit, BASIS, TARGET).misfit_mm
    assert misfit_mm(sternum_mm(fit) + off_mm) == pytest.approx(
        misfit_mm(sternum_mm(fit)) * (1 + 4 * SETTINGS.unlikely)
    )
