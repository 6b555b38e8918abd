import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lubdub.geometry.neighbours import SurfaceFinder, closest_on_triangles
from lubdub.geometry.surface import Surface, cloud

number = st.floats(-5, 5)
point = st.tuples(number, number, number).map(np.array)


@given(point, st.lists(point, min_size=3, max_size=3))
def test_no_place_sampled_on_a_triangle_is_closer_than_the_closest(p: np.ndarray, corners: list) -> None:
    triangle = np.array(corners)
    place = closest_on_triangles(p, triangle[None])[0]
    weights = np.random.default_rng(0).dirichlet([1, 1, 1], 300)
    assert np.linalg.norm(place - p) <= np.linalg.norm(weights @ triangle - p, axis=1).min() + 1e-6


@given(point, st.floats(0.001, 50))
def test_the_nearest_place_does_not_depend_on_where_we_look_first(p: np.ndarray, reach: float) -> None:
    corners = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [3, 3, 8]])
    surface = Surface(corners, np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3]]))
    exact = closest_on_triangles(p, corners[surface.triangles])
    distance = np.linalg.norm(SurfaceFinder(surface).nearest(p, reach) - p)
    assert distance == pytest.approx(np.linalg.norm(exact - p, axis=1).min())


def test_on_a_mesh_the_nearest_place_lies_inside_a_triangle() -> None:
    surface = Surface(np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]]), np.array([[0, 1, 2]]))
    assert SurfaceFinder(surface).nearest(np.array([2.0, 3.0, 4.0]), 1.0) == pytest.approx([2, 3, 0])


def test_on_a_cloud_the_nearest_place_is_a_point() -> None:
    assert SurfaceFinder(cloud(np.eye(3) * 10)).nearest(np.array([9.0, 1.0, 0.0]), 1.0) == pytest.approx([10, 0, 0])
