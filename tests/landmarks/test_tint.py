"""The colours of a scan are read evenly over its skin, whatever the file's own grain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from lubdub.geometry.colour import Colouring, Tint
from lubdub.geometry.surface import Surface, cloud
from lubdub.landmarks.tint import SETTINGS, tint_of
from lubdub.results import CleanScan
from tests.bodies import torso_scan
from tests.scanned import clean_scan

SCAN = clean_scan(torso_scan().surface, np.array([0.0, 0.0, 1.0]), count=8000)


def body(columns: int) -> Surface:
    return torso_scan(columns=columns, rows=columns).surface


def striped(points: np.ndarray) -> np.ndarray:
    """(k, 3) colours that change slowly over the body."""
    return np.stack([120 + 0.3 * points[:, 0], 120 + 0.2 * points[:, 1], np.full(len(points), 90.0)], axis=1)


def tint(surface: Surface) -> Tint:
    return tint_of(surface, Colouring(striped(surface.vertices).astype(np.uint8)), SCAN)


@pytest.mark.parametrize("columns", [40, 120, 400])
def test_places_are_millimetres_apart_on_coarse_and_fine_meshes_and_have_the_colours_there(columns: int) -> None:
    found = tint(body(columns))
    gaps = cKDTree(found.points).query(SCAN.points)[0]
    assert np.percentile(gaps, 95) < 6.0
    assert len(found.points) <= SETTINGS.most_places + len(body(columns).vertices)
    np.testing.assert_allclose(found.colours, striped(found.points), atol=3.0)


def test_every_point_of_a_cloud_has_its_own_colour() -> None:
    points = cloud(SCAN.points)
    found = tint(points)
    np.testing.assert_array_equal(found.points, points.vertices)
    np.testing.assert_allclose(found.colours, striped(points.vertices), atol=1.0)


def test_triangles_without_a_picture_have_no_colour() -> None:
    surface = body(60)
    count = len(surface.triangles)
    corners, picture = np.full((count, 3, 2), 0.5, np.float32), np.full((4, 4, 3), 200, np.uint8)
    half = np.where(np.arange(count) < count // 2, 0, -1).astype(np.int8)
    found = tint_of(surface, Colouring(None, (picture,), corners, half), SCAN)
    whole = tint_of(surface, Colouring(None, (picture,), corners, np.zeros(count, np.int8)), SCAN)
    assert 0 < len(found.points) < len(whole.points)
    assert (found.colours == 200).all()


def test_what_lies_far_from_the_cleaned_skin_is_not_read() -> None:
    there = replace(SCAN, points=SCAN.points + 5000.0)
    assert len(tint_of(body(60), Colouring(np.full((len(body(60).vertices), 3), 9, np.uint8)), there).points) == 0


def test_the_unit_of_the_file_changes_nothing() -> None:
    surface = body(60)
    metres = Surface(surface.vertices / 1000, surface.triangles)
    bigger = replace(SCAN.body_from_file, scale=1000.0)
    scan: CleanScan = replace(SCAN, body_from_file=bigger)
    one, other = tint(surface), tint_of(metres, Colouring(striped(surface.vertices).astype(np.uint8)), scan)
    np.testing.assert_allclose(other.points * 1000, one.points, atol=1e-6)
