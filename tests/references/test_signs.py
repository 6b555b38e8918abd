"""Signs of landmarks can be learned from a few made-up skins; no downloaded source is needed."""

from __future__ import annotations

import numpy as np

from lubdub.geometry.signs import Signs
from lubdub.landmarks.places import find_navel
from lubdub.landmarks.relief import Skin
from references.make.sightings import Sighting
from references.make.signs import LearningSettings, learn_signs


def dented(random: np.random.Generator) -> Sighting:
    """A bent sheet with a dent for a navel and a hill for each nipple, 1 mm of noise."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-160, 161, 4.0), np.arange(-480, 1, 4.0)))
    marks = np.array([[0.0, -360.0 + random.normal() * 10], [90.0, -150.0], [-90.0, -150.0]])
    z = 60 - 0.002 * x**2 + random.normal(size=len(x))
    for (across, along), height, radius in zip(marks, (-9.0, 9.0, 9.0), (14.0, 18.0, 18.0), strict=True):
        z += height * np.exp(-0.5 * ((x - across) ** 2 + (y - along) ** 2) / radius**2)
    normals = np.stack([0.004 * x, 0 * x, np.ones_like(x)], axis=1)
    places = np.column_stack([marks, 60 - 0.002 * marks[:, 0] ** 2])
    points = np.stack([x, y, z], axis=1)
    return Sighting(points, normals / np.linalg.norm(normals, axis=1, keepdims=True), places, 150.0)


def learned() -> Signs:
    random = np.random.default_rng(4)
    return learn_signs(
        [dented(random) for _ in range(12)], LearningSettings(filters=4, looks=2, stiffness=0.3, rounds=60)
    )


def test_learned_signs_find_a_dent_that_was_not_learned_from() -> None:
    signs, other = learned(), dented(np.random.default_rng(5))
    skin = Skin(other.points, other.normals, other.sternum_mm)
    for up in (-25.0, 25.0):
        found = find_navel(skin, other.marks[0] + [0.0, up, 0.0], signs)
        assert np.linalg.norm((found.position - other.marks[0])[:2]) < 8.0
        assert found.doubt_mm < 25.0


def test_the_same_sightings_teach_the_same() -> None:
    one, two = learned(), learned()
    np.testing.assert_array_equal(one.navel.weights, two.navel.weights)
    np.testing.assert_array_equal(one.nipple.filters, two.nipple.filters)
