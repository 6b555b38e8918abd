from __future__ import annotations

import numpy as np
import pytest

from lubdub.landmarks.relief import CELL, Skin, grain, relief, window_at

HALF = (20, 20)


def sheet(height_mm: float = 0.0, radius_mm: float = 12.0, at: tuple[float, float] = (0.0, 0.0)) -> Skin:
    """A gently bent chest, 150 mm the unit of length, with one hill."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-120, 121, 2.5), np.arange(-120, 121, 2.5)))
    hill = height_mm * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / radius_mm**2)
    points = np.stack([x, y, 40 - 0.002 * x**2 - 0.001 * y**2 + hill], axis=1)
    normals = np.stack([0.004 * x, 0.002 * y, np.ones_like(x)], axis=1)
    return Skin(points, normals / np.linalg.norm(normals, axis=1, keepdims=True), 150.0)


def test_smooth_skin_is_flat() -> None:
    skin = sheet()
    assert np.abs(relief(skin, window_at(skin, np.zeros(3), 1.0, HALF))).max() < 0.003


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_hill_stands_where_it_is_outwards_and_up(side: float) -> None:
    skin = sheet(8.0, at=(side * 30.0, -15.0))
    window = window_at(skin, np.zeros(3), side, HALF)
    heights = relief(skin, window)
    row, column = np.unravel_index(heights.argmax(), heights.shape)
    assert (CELL * (column - HALF[0]), CELL * (row - HALF[1])) == pytest.approx((0.2, -0.1), abs=1.5 * CELL)


def test_a_map_of_twice_the_body_is_the_same_map() -> None:
    skin = sheet(8.0)
    twice = Skin(2 * skin.points, skin.normals, 2 * skin.size)
    one, two = (relief(each, window_at(each, np.zeros(3), 1.0, HALF)) for each in (skin, twice))
    np.testing.assert_allclose(one, two, atol=1e-9)


def test_a_hole_is_bridged() -> None:
    skin = sheet(8.0)
    near = np.hypot(skin.points[:, 0] - 60, skin.points[:, 1]) < 15
    holed = Skin(skin.points[~near], skin.normals[~near], skin.size)
    window = window_at(skin, np.zeros(3), 1.0, HALF)
    assert np.abs(relief(holed, window) - relief(skin, window)).max() < 0.01


def test_noise_is_measured_as_grain() -> None:
    skin, random = sheet(8.0), np.random.default_rng(1)
    window = window_at(skin, np.zeros(3), 1.0, HALF)
    grains = []
    for noise_mm in (0.0, 1.0, 4.0):
        rough = skin.points + noise_mm * random.normal(size=(len(skin.points), 1)) * [0.0, 0.0, 1.0]
        grains.append(grain(relief(Skin(rough, skin.normals, skin.size), window)))
    assert grains[0] < grains[1] < grains[2]
    assert grains[2] / grains[1] == pytest.approx(4.0, rel=0.4)


def test_where_there_is_no_skin_the_map_is_flat() -> None:
    skin = sheet()
    back = Skin(skin.points, -skin.normals, skin.size)
    window = window_at(skin, np.zeros(3), 1.0, HALF)
    assert not relief(back, window).any()
