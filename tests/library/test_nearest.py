import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.geometry.surface import Surface
from lubdub.library import nearest
from lubdub.library.load import load_library
from lubdub.library.nearest import NearestSettings, rank_by_shape

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


def test_every_shipped_reference_is_compared() -> None:
    ranked = rank_by_shape(REFERENCES[5].surface, REFERENCES)
    assert {one.id for one in ranked} == {one.id for one in REFERENCES}


@pytest.mark.parametrize("index", [0, 8, 21, 33])
def test_a_large_library_is_searched_without_comparing_everybody_and_the_best_is_the_same(
    index: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(index)
    body = REFERENCES[index].surface
    stretched = body.vertices * random.uniform(0.95, 1.05, 3) @ Rotation.random(random_state=index).as_matrix().T
    everybody = rank_by_shape(Surface(stretched, body.triangles), REFERENCES)
    monkeypatch.setattr(nearest, "SETTINGS", NearestSettings(most_compared=8))
    few = rank_by_shape(Surface(stretched, body.triangles), REFERENCES)
    assert len(few) == 8
    assert few[0].id == everybody[0].id
    assert few[0].chamfer_mm == everybody[0].chamfer_mm
    assert sum(one.weight for one in few) == pytest.approx(1)


def test_another_library_is_not_searched_with_the_index_of_the_last_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearest, "SETTINGS", NearestSettings(most_compared=4))
    first, second = REFERENCES[:17], REFERENCES[17:]
    for library in (first, second, first):
        ranked = rank_by_shape(REFERENCES[0].surface, library)
        assert {one.id for one in ranked} <= {one.id for one in library}


def test_a_prepared_library_is_not_prepared_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearest, "SETTINGS", NearestSettings(most_compared=8))
    nearest.prepare(REFERENCES)
    monkeypatch.setattr(nearest, "ShapeIndex", None)
    assert len(rank_by_shape(REFERENCES[0].surface, REFERENCES)) == 8
