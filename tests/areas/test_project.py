from dataclasses import replace

import numpy as np
import pytest

from lubdub.areas.project import Skin, SkinPlace, on_file
from lubdub.geometry.frames import Similarity
from lubdub.geometry.neighbours import SurfaceFinder
from lubdub.geometry.surface import Surface, cloud
from lubdub.results import CleanScan, Unit


def bowl() -> CleanScan:
    """A gently sloping skin facing the front, with another layer 80 mm behind it."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(-100, 101, 4.0), np.arange(-200, 1, 4.0)))
    front = np.stack([x, y, 50 + 0.2 * x], axis=1)
    back = np.stack([x, y, np.full_like(x, -30.0)], axis=1)
    normal = np.array([-0.2, 0.0, 1.0]) / np.hypot(0.2, 1)
    normals = np.concatenate([np.tile(normal, (len(x), 1)), np.tile([0.0, 0.0, 1.0], (len(x), 1))])
    points = np.concatenate([front, back])
    display = Surface(points, np.zeros((0, 3), int))
    border = np.zeros(len(points), bool)
    return CleanScan(points, normals, border, lambda: display, Similarity.identity(), Unit("mm", 1.0, "given"))


def on_skin(*place: float) -> SkinPlace:
    return SkinPlace(np.array(place), np.array([0.0, 0.0, 1.0]), 0.0)


def test_a_place_drops_straight_forward_onto_the_front_skin() -> None:
    dropped = Skin(bowl()).drop(np.array([30.0, -60.0, 0.0]))
    assert dropped.position == pytest.approx([30.0, -60.0, 56.0], abs=0.5)
    assert dropped.normal == pytest.approx([-0.196, 0, 0.98], abs=0.01)


def test_a_place_beside_the_scan_says_how_far_the_skin_is() -> None:
    assert Skin(bowl()).drop(np.array([140.0, -60.0, 0.0])).gap_mm == pytest.approx(40, abs=4)


def test_the_snapped_place_lies_on_the_files_own_triangles_whatever_its_unit() -> None:
    corners = np.array([[0, 0, 0.05], [0.2, 0, 0.05], [0, 0.2, 0.05]])
    finder = SurfaceFinder(Surface(corners, np.array([[0, 1, 2]])))
    place = on_file(on_skin(40.0, 30.0, 61.0), finder, Similarity(1000.0, np.eye(3), np.zeros(3)))
    assert place == pytest.approx([40.0, 30.0, 50.0])


def test_on_a_cloud_a_place_stays_on_the_smooth_skin_through_its_noisy_points() -> None:
    scan, random = bowl(), np.random.default_rng(3)
    noisy = scan.points + random.normal(size=scan.points.shape) * [0.0, 0.0, 4.0]
    place = Skin(replace(scan, points=noisy)).drop(np.array([30.5, -61.0, 0.0]))
    found = on_file(place, SurfaceFinder(cloud(noisy)), Similarity.identity())
    assert found == pytest.approx([30.5, -61.0, 56.1], abs=2.0)
    assert found[:2] == pytest.approx([30.5, -61.0])


def test_where_a_cloud_has_no_point_the_nearest_one_is_shown() -> None:
    scan = bowl()
    place = Skin(scan).drop(np.array([140.0, -60.0, 0.0]))
    found = on_file(place, SurfaceFinder(cloud(scan.points)), Similarity.identity())
    assert np.linalg.norm(scan.points - found, axis=1).min() == 0
