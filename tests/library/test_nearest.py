import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from lubdub.library.nearest import rank_by_shape

REFERENCES = load_library().references


@pytest.mark.parametrize("index", [0, 15, 30])
def test_a_reference_is_its_own_nearest_wherever_it_lies(index: int) -> None:
    body = REFERENCES[index].surface
    moved = Surface(body.vertices @ Rotation.random(random_state=index).as_matrix().T + 700, body.triangles)
    ranked = rank_by_shape(moved, REFERENCES)
    assert ranked[0].id == REFERENCES[index].id
    assert ranked[0].chamfer_mm == pytest.approx(0, abs=1e-6)


def test_weights_are_shares_and_fall_with_the_distance() -> None:
    ranked = rank_by_shape(REFERENCES[3].surface, REFERENCES)
    weights = [one.weight for one in ranked]
    assert sum(weights) == pytest.approx(1)
    assert weights == sorted(weights, reverse=True)


def test_without_references_there_is_nothing_to_rank() -> None:
    assert rank_by_shape(REFERENCES[0].surface, ()) == ()


def test_size_counts_a_child_is_not_like_a_grown_up() -> None:
    grown = Surface(REFERENCES[0].surface.vertices * 2.0, REFERENCES[0].surface.triangles)
    assert rank_by_shape(grown, REFERENCES)[0].id != REFERENCES[0].id
    assert np.isfinite([one.chamfer_mm for one in rank_by_shape(grown, REFERENCES)]).all()
