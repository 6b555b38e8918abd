"""Cleaning takes the bed and keeps the body, whichever way the body lies in the file."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from lubdub.geometry.surface import cloud, triangle_normals
from lubdub.results import CleanScan, RawScan, ScanRefused, Unit
from lubdub.scans.clean import clean
from tests.bodies import (
    BODY,
    BodyScan,
    add_bed,
    add_floor_clutter,
    as_cloud,
    hide_side,
    inside_out,
    kept,
    noise,
    only_belly,
    rescale,
    shuffled,
    torso_scan,
    turn,
)

MM = Unit("mm", 1.0, "given")
TURNS = [(0, 0, 0), (25, -40, 70), (90, 0, 0), (180, 10, -30)]


def cleaned(scan: BodyScan, with_landmarks: bool = False) -> CleanScan:
    return clean(RawScan(scan.surface, "ply"), MM, scan.landmarks if with_landmarks else {})


def small(size: float = 1.0, **shape: float) -> BodyScan:
    return torso_scan(size=size, columns=100, rows=96, **shape)


def in_body_frame(scan: BodyScan, points: np.ndarray) -> np.ndarray:
    return scan.file_from_body.inverse().apply(points)


def spacing(points: np.ndarray) -> float:
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))


def front_kept(scan: BodyScan, clean_scan: CleanScan) -> float:
    """The share of the chest's front from belly to notch that lies on the cleaned points."""
    skin = scan.surface.vertices[scan.label == BODY]
    place = in_body_frame(scan, skin)
    length = -in_body_frame(scan, scan.landmarks["navel"][None])[0, 1]
    front = skin[(place[:, 2] > -0.15 * length) & (np.abs(place[:, 1] + length / 2) < length / 2)]
    return float((cKDTree(clean_scan.points).query(front)[0] < 1.5 * spacing(clean_scan.points) + 2).mean())


def others_gone(scan: BodyScan, clean_scan: CleanScan) -> float:
    """The share of bed and clutter more than 25 mm from the body of which nothing is left."""
    points = scan.surface.vertices
    others = points[scan.label != BODY]
    far = others[cKDTree(points[scan.label == BODY]).query(others)[0] > 25]
    return float((cKDTree(clean_scan.points).query(far)[0] > 3).mean())


@pytest.mark.parametrize("size", [0.36, 1.0])
@pytest.mark.parametrize("degrees", TURNS)
@pytest.mark.parametrize("with_landmarks", [False, True])
def test_the_bed_goes_and_the_body_stays(size: float, degrees: tuple[float, ...], with_landmarks: bool) -> None:
    bedded = add_bed(hide_side(small(size)), tilt_deg=2, margin_mm=120)
    for scan in (turn(bedded, degrees), turn(as_cloud(noise(bedded, 1.5)), degrees)):
        result = cleaned(scan, with_landmarks)
        assert front_kept(scan, result) > 0.97
        assert others_gone(scan, result) > 0.98
        assert any("flat" in note for note in result.notes)


@pytest.mark.parametrize("damage", [lambda s: s, hide_side, lambda s: as_cloud(hide_side(s)), as_cloud])
@pytest.mark.parametrize("shape", [{}, {"size": 0.36}, {"belly": 0.0, "breast": 0.0}, {"breadth": 1.3}])
def test_a_body_without_a_bed_loses_nothing(damage, shape) -> None:
    scan = turn(damage(small(**shape)), (25, -40, 70))
    for with_landmarks in (False, True):
        result = cleaned(scan, with_landmarks)
        assert cKDTree(result.points).query(scan.surface.vertices)[0].max() < 2 * spacing(scan.surface.vertices) + 4
        assert result.notes == ()


def test_a_chest_cropped_at_all_sides_is_not_taken_for_a_bed() -> None:
    whole = hide_side(small(breast=0.0, belly=0.0), grazing=0.5)
    across, along = whole.surface.vertices[:, 0], whole.surface.vertices[:, 1]
    crop = kept(whole, (np.abs(across) < 130) & (along < -20) & (along > -380))
    for scan in (crop, as_cloud(crop)):
        assert front_kept(scan, cleaned(scan)) > 0.97


def test_floor_and_clutter_go_too() -> None:
    scan = turn(add_floor_clutter(add_bed(hide_side(small(0.5)))), (25, -40, 70))
    for with_landmarks in (False, True):
        result = cleaned(scan, with_landmarks)
        assert front_kept(scan, result) > 0.97
        assert others_gone(scan, result) > 0.98


def test_a_scan_of_a_body_all_round_on_a_bed_keeps_its_flanks() -> None:
    scan = add_bed(small(), under=True)
    result = cleaned(scan)
    assert others_gone(scan, result) > 0.98
    skin = scan.surface.vertices[scan.label == BODY]
    flanks = skin[skin[:, 2] > skin[:, 2].min() + 30]
    assert (cKDTree(result.points).query(flanks)[0] < 12).mean() > 0.99


@settings(max_examples=6, deadline=None)
@given(
    degrees=st.tuples(st.floats(-180, 180), st.floats(-180, 180), st.floats(-180, 180)),
    shift=st.tuples(st.floats(-2000, 2000), st.floats(-2000, 2000), st.floats(-2000, 2000)),
)
def test_a_moved_body_is_cleaned_to_the_same_body_moved(degrees, shift) -> None:
    scan = as_cloud(add_bed(hide_side(small(0.7)), margin_mm=100))
    moved = turn(scan, degrees, shift)
    here, there = cleaned(scan), cleaned(moved)
    back = in_body_frame(moved, there.points)
    assert cKDTree(here.points).query(back)[0].max() < 12
    assert cKDTree(back).query(here.points)[0].max() < 12
    nearest = cKDTree(here.points).query(back)[1]
    turned_back = moved.file_from_body.inverse().turn(there.normals)
    assert np.median((here.normals[nearest] * turned_back).sum(axis=1)) > 0.99


@pytest.mark.parametrize("damage", [lambda s: s, as_cloud])
def test_the_order_of_vertices_does_not_matter(damage) -> None:
    scan = damage(add_bed(hide_side(small(0.7)), margin_mm=100))
    here, there = cleaned(scan), cleaned(shuffled(scan))
    assert abs(len(here.points) - len(there.points)) <= 0.02 * len(here.points)
    assert cKDTree(here.points).query(there.points)[0].max() < 8


@pytest.mark.parametrize("with_landmarks", [False, True])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_normals_and_triangles_face_outward_however_the_file_was_wound(share: float, with_landmarks: bool) -> None:
    scan = turn(inside_out(hide_side(small(0.8)), share), (25, -40, 70))
    truth = turn(hide_side(small(0.8)), (25, -40, 70)).surface
    result = cleaned(scan, with_landmarks)
    at = cKDTree(truth.vertices).query(result.points)[1]
    assert ((truth.normals[at] * result.normals).sum(axis=1) > 0.5).mean() > 0.99
    shown = result.display
    facing = triangle_normals(shown.vertices, shown.triangles)
    near = cKDTree(truth.vertices).query(shown.vertices[shown.triangles].mean(axis=1))[1]
    assert ((facing * truth.normals[near]).sum(axis=1) > 0).mean() > 0.99


@pytest.mark.parametrize("all_round", [False, True])
def test_a_cloud_gets_outward_normals_and_a_skin_to_click_on(all_round: bool) -> None:
    whole = small(0.8)
    scan = turn(as_cloud(whole if all_round else hide_side(whole)), (25, -40, 70))
    truth = turn(whole, (25, -40, 70)).surface
    result = cleaned(scan)
    at = cKDTree(truth.vertices).query(result.points)[1]
    assert ((truth.normals[at] * result.normals).sum(axis=1) > 0.5).mean() > 0.98
    assert len(result.display.triangles) > 1.8 * len(result.points)
    facing = triangle_normals(result.display.vertices, result.display.triangles)
    near = cKDTree(truth.vertices).query(result.display.vertices[result.display.triangles].mean(axis=1))[1]
    assert ((facing * truth.normals[near]).sum(axis=1) > 0).mean() > 0.98


def test_the_border_is_the_rim_and_nothing_else() -> None:
    scan = hide_side(small())
    result = cleaned(scan)
    edges = np.sort(np.concatenate([scan.surface.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    pairs, counts = np.unique(edges, axis=0, return_counts=True)
    rim = scan.surface.vertices[np.unique(pairs[counts == 1])]
    from_rim = cKDTree(rim).query(result.points)[0]
    assert result.is_border[from_rim < 2].mean() > 0.7
    assert result.is_border[from_rim > 30].mean() < 0.01


@pytest.mark.parametrize("as_points", [False, True])
def test_a_dense_scan_is_thinned_evenly(as_points: bool) -> None:
    dense = torso_scan(columns=420, rows=380)
    result = cleaned(as_cloud(hide_side(dense)) if as_points else dense)
    assert 15_000 < len(result.points) <= 25_000
    assert len(result.display.vertices) <= 40_000
    assert len(result.display.triangles) > 0
    gaps = cKDTree(result.points).query(result.points, k=2)[0][:, 1]
    assert np.percentile(gaps, 99) < 3 * np.median(gaps)


def test_clean_points_are_in_millimetres_on_the_files_axes() -> None:
    scan = turn(small(0.8), (25, -40, 70), (50, 60, 70))
    in_metres = rescale(scan, "m")
    result = clean(RawScan(in_metres.surface, "ply"), Unit("m", 1000.0, "found"), in_metres.landmarks)
    assert cKDTree(scan.surface.vertices).query(result.points)[0].max() < 6
    assert np.allclose(result.body_from_file.matrix(), np.diag([1000.0, 1000.0, 1000.0, 1.0]))


def test_far_things_are_cropped_when_the_landmarks_are_known() -> None:
    scan = small()
    legs = scan.surface.vertices - [0, 600, 0]
    both = BodyScan(cloud(np.concatenate([scan.surface.vertices, legs])), np.zeros(0), scan.landmarks, {})
    assert cleaned(both, with_landmarks=True).points[:, 1].min() > -367 * 1.5
    assert cleaned(both).points[:, 1].min() < -900


def test_a_second_body_is_dropped_and_said() -> None:
    scan = as_cloud(hide_side(small(0.8)))
    other = scan.surface.vertices[scan.surface.vertices[:, 1] < 30] + [700, 100, 0]
    both = BodyScan(cloud(np.concatenate([scan.surface.vertices, other])), np.zeros(0), scan.landmarks, {})
    result = cleaned(both)
    assert np.abs(result.points[:, 0]).max() < 200
    assert [reason.code for reason in result.warnings] == ["two_bodies"]
    assert cleaned(both, with_landmarks=True).warnings == ()


def test_stray_points_go() -> None:
    scan = as_cloud(hide_side(small()))
    rng = np.random.default_rng(0)
    strays = rng.uniform([-300, -500, -200], [300, 100, 300], (60, 3))
    strays = strays[cKDTree(scan.surface.vertices).query(strays)[0] > 40]
    result = clean(RawScan(cloud(np.concatenate([scan.surface.vertices, strays])), "xyz"), MM, {})
    assert cKDTree(result.points).query(strays)[0].min() > 5


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ScanRefused) as caught:
        cleaned(torso_scan(columns=16, rows=16))
    assert caught.value.reason.code == "too_few_points"


def test_landmarks_from_another_scan_are_refused() -> None:
    scan = small()
    elsewhere = turn(scan, shift=(5000, 0, 0)).landmarks
    with pytest.raises(ScanRefused) as caught:
        clean(RawScan(scan.surface, "ply"), MM, elsewhere)
    assert caught.value.reason.code == "landmarks_off_scan"


@pytest.mark.parametrize("depth", [0.0, 2.0])
def test_a_sheet_alone_is_no_body(depth: float) -> None:
    rng = np.random.default_rng(0)
    sheet = rng.uniform([-400, -400, -depth], [400, 400, depth + 1e-9], (5000, 3))
    with pytest.raises(ScanRefused) as caught:
        clean(RawScan(cloud(sheet), "xyz"), MM, {})
    assert caught.value.reason.code == "no_body_found"


def test_points_that_all_coincide_are_no_body() -> None:
    with pytest.raises(ScanRefused):
        clean(RawScan(cloud(np.ones((30_000, 3))), "xyz"), MM, {})


def test_a_belly_alone_is_still_cleaned() -> None:
    scan = only_belly(hide_side(small()))
    assert len(cleaned(scan).points) == len(scan.surface.vertices)
