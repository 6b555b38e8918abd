import numpy as np
import pytest

from lubdub.areas.project import Skin, snap_to_file
from lubdub.geometry.frames import Similarity
from lubdub.geometry.neighbours import SurfaceFinder
from lubdub.geometry.surface import Surface
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
    return CleanScan(points, normals, border, display, Similarity.identity(), Unit("mm", 1.0, "given"))


def test_a_place_drops_straight_forward_onto_the_front_skin() -> None:
    dropped = Skin(bowl()).drop(np.array([30.0, -60.0, 0.0]))
    assert dropped.position == pytest.approx([30.0, -60.0, 56.0], abs=0.5)
    assert dropped.normal == pytest.approx([-0.196, 0, 0.98], abs=0.01)


def test_a_place_beside_the_scan_says_how_far_the_skin_is() -> None:
    assert Skin(bowl()).drop(np.array([140.0, -60.0, 0.0])).gap_mm == pytest.approx(40, abs=4)


def test_the_snapped_place_lies_on_the_files_own_triangles_whatever_its_unit() -> None:
    corners = np.array([[0, 0, 0.05], [0.2, 0, 0.05], [0, 0.2, 0.05]])
    finder = SurfaceFinder(Surface(corners, np.array([[0, 1, 2]])))
    place = snap_to_file(np.array([40.0, 30.0, 61.0]), finder, Similarity(1000.0, np.eye(3), np.zeros(3)))
    assert place == pytest.approx([40.0, 30.0, 50.0])
