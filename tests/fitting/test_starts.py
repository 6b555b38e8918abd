"""Several sizes to start from, and the end that explains the scan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lubdub.fitting.expected import Expected, Span, anybody
from lubdub.fitting.shape import Pose, Pull, Target, body_of, carried, fit_shape, sternum_mm
from lubdub.fitting.starts import SETTINGS, best_end, ended, sized_starts, start_from, starts_at_notch
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
ANYBODY = anybody(BASIS)
PULLS = {name: Pull(SCAN.landmarks[name], 10.0) for name in SEEN}


def start() -> Pose:
    return start_from({name: SCAN.landmarks[name] for name in SEEN}, BASIS, ANYBODY)


def with_sternum(length_mm: float) -> Expected:
    return replace(ANYBODY, sternum=Span(length_mm, 20.0))


def test_landmarks_place_and_size_a_start() -> None:
    places = {name: SCAN.landmarks[name] for name in SEEN}
    grown = {name: 1.2 * place + 7.0 for name, place in places.items()}
    once, larger = (start_from(these, BASIS, ANYBODY).body_from_basis for these in (places, grown))
    assert larger.scale == pytest.approx(1.2 * once.scale)
    assert np.allclose(larger.translation, 1.2 * once.translation + 7.0)


def test_starts_of_all_sizes_agree_about_their_middle() -> None:
    begin = start()
    in_basis = begin.body_from_basis.inverse().apply(MIDDLE)
    starts = sized_starts(begin, MIDDLE, BASIS, with_sternum(180.0))
    assert len(starts) == len(SETTINGS.sizes) + len(SETTINGS.expected_sizes)
    for one in starts:
        assert np.allclose(one.body_from_basis.apply(in_basis), MIDDLE)


def test_a_start_of_the_expected_size_has_the_expected_breastbone() -> None:
    begin = start()
    expected = sized_starts(begin, MIDDLE, BASIS, with_sternum(123.0))[len(SETTINGS.sizes)]
    body = carried(Surface(body_of(expected, BASIS), BASIS.triangles), BASIS)
    assert sternum_mm(body) == pytest.approx(123.0)


def test_a_stretched_fit_is_tried_again_from_its_notch_to_the_navel_and_with_the_expected_breastbone() -> None:
    begin = start()
    _, fit = fit_shape(TARGET, PULLS, BASIS, begin)
    navel = SCAN.landmarks["navel"]
    to_navel, expected = (
        carried(Surface(body_of(one, BASIS), BASIS.triangles), BASIS)
        for one in starts_at_notch(fit, navel, BASIS, with_sternum(0.7 * sternum_mm(fit)))
    )
    notch = fit.landmarks["suprasternal_notch"]
    assert to_navel.landmarks["suprasternal_notch"][1] == pytest.approx(notch[1])
    assert to_navel.landmarks["navel"][1] == pytest.approx(navel[1])
    assert expected.landmarks["suprasternal_notch"][1] == pytest.approx(notch[1])
    assert sternum_mm(expected) == pytest.approx(0.7 * sternum_mm(fit), rel=0.05)


def test_without_an_expected_breastbone_the_notch_and_navel_alone_hang_a_body_up() -> None:
    _, fit = fit_shape(TARGET, PULLS, BASIS, start())
    assert len(starts_at_notch(fit, SCAN.landmarks["navel"], BASIS, ANYBODY)) == 1


def test_no_start_ends_worse_than_the_best_end() -> None:
    begin = start()
    starts = sized_starts(begin, MIDDLE, BASIS, ANYBODY)
    best = best_end(TARGET, PULLS, BASIS, starts, ANYBODY)
    alone = [best_end(TARGET, PULLS, BASIS, [one], ANYBODY).misfit_mm for one in starts]
    assert best.misfit_mm == min(alone)


@pytest.mark.parametrize("off_mm", [-40.0, 40.0])
def test_an_unexpected_size_counts_against_an_end(off_mm: float) -> None:
    pose, fit = fit_shape(TARGET, PULLS, BASIS, start())

    def misfit_mm(expected_mm: float) -> float:
        return ended(pose, fit, BASIS, TARGET, with_sternum(expected_mm)).misfit_mm

    assert misfit_mm(sternum_mm(fit)) == ended(pose, fit, BASIS, TARGET, ANYBODY).misfit_mm
    assert misfit_mm(sternum_mm(fit) + off_mm) == pytest.approx(misfit_mm(sternum_mm(fit)) * (1 + SETTINGS.unlikely))
