from __future__ import annotations

import numpy as np
import pytest

from lubdub.landmarks.signs import GRAINS, MARGIN, answers, evidence, graininess, levelled, patches
from lubdub.library.load import load_library

SIGNS = load_library().signs
SIDE = 2 * MARGIN + 11


def test_there_is_evidence_for_every_place_with_a_whole_patch_around() -> None:
    heights = 0.01 * np.random.default_rng(1).normal(size=(SIDE, SIDE + 4))
    for sign in (SIGNS.navel, SIGNS.nipple):
        assert evidence(sign, heights, 0.002).shape == (11, 15)


def test_a_slope_is_no_evidence() -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, SIDE), np.linspace(-1, 1, SIDE))
    for sign in (SIGNS.navel, SIGNS.nipple):
        found = evidence(sign, 0.3 * x - 0.2 * y, 0.002)
        np.testing.assert_allclose(found, evidence(sign, 0 * x, 0.002), atol=1e-2)


def test_the_slope_is_all_that_levelling_takes_away() -> None:
    level = levelled()
    np.testing.assert_allclose(level @ level, level, atol=1e-9)
    assert np.trace(level) == pytest.approx(len(level) - 3)


def test_the_wildest_skin_is_no_stronger_evidence_than_the_saturated() -> None:
    heights = np.random.default_rng(2).normal(size=(SIDE, SIDE))
    count = SIGNS.nipple.filters.shape[1]
    assert np.abs(answers(SIGNS.nipple, 100 * heights)[:, :count]).max() <= 3.0


def test_patches_come_row_by_row() -> None:
    heights = np.arange(SIDE * SIDE, dtype=float).reshape(SIDE, SIDE)
    middle = patches(heights)[:, patches(heights).shape[1] // 2].reshape(11, 11)
    np.testing.assert_array_equal(middle, heights[MARGIN:-MARGIN, MARGIN:-MARGIN])


def test_graininess_runs_from_the_finest_to_the_coarsest_scanner() -> None:
    assert [graininess(grain) for grain in (0.0, GRAINS[0], GRAINS[1], 1.0)] == pytest.approx([0.0, 0.0, 1.0, 1.0])
