"""How sure the methods are of what they carry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lubdub.fitting.shape import carried
from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from lubdub.methods import PAPER_SIGMA, Chest, _carried_sigma
from lubdub.results import AREA_NAMES, Landmark, Patient

GIRL = next(one for one in load_library().references if one.id == "girl-06")
LENGTH = 90.0


@pytest.mark.parametrize("spread", [0.0, 1.0, 10.0, 40.0])
def test_people_who_disagree_about_a_body_only_make_its_regions_larger(spread: float) -> None:
    marked = replace(GIRL, spread_mm=dict.fromkeys(AREA_NAMES, spread))
    for name in AREA_NAMES:
        calibrated, now = _carried_sigma(GIRL, name, LENGTH), _carried_sigma(marked, name, LENGTH)
        np.testing.assert_allclose(calibrated, PAPER_SIGMA * LENGTH)
        assert (now >= calibrated).all()
        assert (now > calibrated + 0.001).all() == (spread > 0.0)


def test_a_disagreement_grows_with_the_body_it_is_carried_to() -> None:
    marked = replace(GIRL, spread_mm={"mitral": 20.0})
    small, large = (_carried_sigma(marked, "mitral", length) for length in (60.0, 120.0))
    np.testing.assert_allclose(large, 2 * small)


def test_the_notch_is_the_marked_one_or_else_that_of_the_methods_own_body() -> None:
    basis = load_library().basis
    body = carried(Surface(basis.mean + [0.0, 5.0, 0.0], basis.triangles), basis)
    mark = Landmark(np.array([1.0, 2.0, 3.0]), "given", 6.0)
    chest = Chest(None, {"suprasternal_notch": mark}, Patient(), 18.0)  # type: ignore[arg-type]
    np.testing.assert_array_equal(chest.notch(body), mark.position)
    bare = replace(chest, landmarks={})
    np.testing.assert_array_equal(bare.notch(body), body.landmarks["suprasternal_notch"])
    with pytest.raises(ValueError, match="notch"):
        bare.notch(None)
