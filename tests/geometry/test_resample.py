import numpy as np
import pytest
from scipy.spatial import cKDTree

from lubdub.geometry.anchors import anchored
from lubdub.geometry.resample import area_mm2, front_shell, rim_of, spread_points, subdivided, thin
from lubdub.geometry.surface import Surface, edges_of
from tests.bodies import Shape, torso_surface
from tests.overlays import motion


@pytest.fixture(scope="module")
def body() -> Surface:
    return torso_surface(Shape(), 44, 42)


def euler(surface: Surface) -> int:
    return len(surface.vertices) - len(edges_of(surface.triangles)) + len(surface.triangles)


@pytest.mark.parametrize("longest", [25.0, 11.0])
def test_subdividing_keeps_the_skin_and_opens_no_crack(body: Surface, longest: float) -> None:
    fine = subdivided(body, longest)
    ends = fine.vertices[edges_of(fine.triangles)]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() <= longest
    assert area_mm2(fine) == pytest.approx(area_mm2(body))
    assert euler(fine) == euler(body)
    assert np.array_equal(fine.vertices[: len(body.vertices)], body.vertices)
    # Winding is kept: the normals still look outward.
    assert (fine.normals[: len(body.vertices)] * body.normals).sum(axis=1).min() > 0.5


def test_a_surface_that_is_fine_enough_stays_as_it_is(body: Surface) -> None:
    assert subdivided(body, 1000) is body


def test_an_edge_of_no_length_is_refused(body: Surface) -> None:
    with pytest.raises(ValueError, match="positive"):
        subdivided(body, 0)


def test_the_front_shell_is_one_piece_that_faces_the_front(body: Surface) -> None:
    front = front_shell(body)
    assert 0.3 < len(front.vertices) / len(body.vertices) < 0.7
    assert euler(front) == 1
    assert len(np.unique(front.triangles)) == len(front.vertices)
    assert front.vertices[:, 2].min() > body.vertices[:, 2].min() + 50


def test_a_body_turned_away_has_no_front_left(body: Surface) -> None:
    lying = Surface(np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0]]), np.array([[0, 1, 2]]))
    with pytest.raises(ValueError, match="faces the front"):
        front_shell(lying)


def test_the_rim_of_an_open_tube_is_its_two_ends(body: Surface) -> None:
    assert np.array_equal(np.flatnonzero(rim_of(body)), np.r_[0:44, 41 * 44 : 42 * 44])


def test_spread_points_lie_dense_on_the_skin_and_know_the_rim(body: Surface) -> None:
    points, on_rim = spread_points(body, 6.0)
    everywhere = subdivided(body, 9.0).vertices
    assert cKDTree(points).query(everywhere)[0].max() < 6.0
    ends = np.abs(points[:, 1] - points[:, 1].min()) < 1e-6
    ends |= np.abs(points[:, 1] - points[:, 1].max()) < 1e-6
    assert np.array_equal(on_rim, ends)


def test_thinning_leaves_given_points_one_to_a_cube_in_any_order() -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform(0, 100, (5000, 3))
    marked = points[:, 0] < 5
    shuffle = rng.permutation(5000)
    once = thin(points, points, marked, 20)
    again = thin(points[shuffle], points[shuffle], marked[shuffle], 20)
    assert 125 <= len(once.points) <= 216
    assert np.array_equal(once.points, again.points)
    assert np.array_equal(once.marked, again.marked)
    assert np.array_equal(once.marked, np.floor(once.points[:, 0] / 20) == 0)
    assert cKDTree(points).query(once.points)[0].max() == 0


def test_anchored_places_move_with_their_mesh(body: Surface) -> None:
    places = subdivided(body, 15).vertices[-50:]
    anchors = anchored(body, places)
    assert np.allclose(anchors.on(body.vertices), places, atol=1e-9)
    assert np.allclose(anchors.weights.sum(axis=1), 1)
    moved = motion(70, (1, 2, 3), (10, 20, 30))
    assert np.allclose(anchors.on(moved.apply(body.vertices)), moved.apply(places))
