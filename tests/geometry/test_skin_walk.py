"""Going along a skin."""

from __future__ import annotations

import numpy as np
import pytest

from lubdub.geometry.skin_walk import SkinWalker
from lubdub.geometry.surface import Surface
from tests.views import sample

BARREL_MM = 100.0


@pytest.fixture(scope="module")
def barrel() -> SkinWalker:
    """Half a cylinder about the body's long axis."""
    angles, heights = np.meshgrid(np.linspace(0.1, np.pi - 0.1, 200), np.linspace(-100, 100, 60))
    out = np.stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)], axis=-1)
    points = (BARREL_MM * out + np.stack([0 * heights, heights, 0 * heights], axis=-1)).reshape(-1, 3)
    corner = (np.arange(59)[:, None] * 200 + np.arange(199)).ravel()
    faces = np.concatenate([[corner, corner + 200, corner + 1], [corner + 1, corner + 200, corner + 201]], axis=1).T
    return SkinWalker(Surface(points, faces), points, out.reshape(-1, 3))


def test_a_walk_goes_as_far_along_the_skin_as_it_was_told(barrel: SkinWalker) -> None:
    front = np.array([0.0, 0.0, BARREL_MM])
    there = barrel.walk(front, 50.0, 0.0)
    assert np.hypot(there[0], there[2]) == pytest.approx(BARREL_MM, abs=0.1)
    assert BARREL_MM * np.arctan2(there[0], there[2]) == pytest.approx(50.0, abs=1.0)
    assert there[1] == pytest.approx(0.0, abs=0.1)


def test_a_walk_and_the_way_back_end_where_they_began() -> None:
    scan = sample.clean_scan()
    walker = SkinWalker(scan.display, scan.points, scan.normals)
    start = walker.nearest(sample.BODY.areas["mitral"])
    there = walker.walk(start, 10.0, -4.0)
    assert np.linalg.norm(there - start) == pytest.approx(np.hypot(10, 4), abs=1.0)
    assert np.linalg.norm(walker.walk(there, -10.0, 4.0) - start) < 1.5


def test_one_press_of_a_key_is_two_millimetres(barrel: SkinWalker) -> None:
    front = np.array([0.0, 0.0, BARREL_MM])
    assert barrel.walk(front, 0.0, 2.0)[1] == pytest.approx(2.0, abs=0.05)
    np.testing.assert_allclose(barrel.walk(front, 0.0, 0.0), front, atol=0.01)


def test_nobody_walks_off_the_rim(barrel: SkinWalker) -> None:
    top = np.array([0.0, 100.0, BARREL_MM])
    assert barrel.walk(top, 0.0, 60.0)[1] == pytest.approx(100.0, abs=0.1)
