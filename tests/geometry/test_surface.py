import numpy as np
import pytest

from lubdub.geometry.surface import Surface, carry, edges_of

SQUARE = Surface(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("triangle", [[0, 1, 4], [0, 1, -1], [0, 1, 99999999]])
def test_a_triangle_without_its_vertex_is_refused(triangle: list[int]) -> None:
    with pytest.raises(ValueError, match="vertex"):
        Surface(SQUARE.vertices, np.array([triangle]))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Surface(np.full((3, 3), bad), np.zeros((0, 3), int))


def test_counter_clockwise_seen_from_outside_points_outward() -> None:
    assert np.allclose(SQUARE.normals, [0, 0, 1])


def test_keeping_a_part_keeps_only_whole_triangles() -> None:
    part = SQUARE.kept(np.array([True, True, True, False]))
    assert part.triangles.tolist() == [[0, 1, 2]]


def test_each_edge_is_counted_once() -> None:
    assert len(edges_of(SQUARE.triangles)) == 5


def test_carried_points_follow_the_mesh() -> None:
    weights, corners = np.array([[0.2, 0.3, 0.5]]), np.array([[0, 1, 2]])
    before, after = carry(weights, corners, SQUARE.vertices), carry(weights, corners, SQUARE.vertices + [5, 0, 0])
    assert np.allclose(after - before, [5, 0, 0])
