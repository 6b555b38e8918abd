"""Printed stickers are found where they are, told apart, measured, and seen to be mirrored; bare skin shows none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import Similarity
from lubdub.geometry.stickers import MARK_CELLS, STICKERS, SeenSticker, Sticker, white_between
from lubdub.geometry.surface import Surface
from lubdub.landmarks.sticker_views import ColouredSkin, View, towards
from lubdub.landmarks.stickers import find_stickers, marks_in
from tests import bodies
from tests.painted import BONES, PaintedScan, painted, painted_points, stuck_on


def found(scan: PaintedScan) -> tuple[SeenSticker, ...]:
    cleaned = scan.cleaned()
    surface = Surface(cleaned.body_from_file.apply(scan.scan.surface.vertices), scan.scan.surface.triangles)
    return find_stickers(surface, scan.colouring, cleaned)


def turned(scan: PaintedScan, seed: int) -> tuple[PaintedScan, Similarity]:
    motion = Similarity(1.0, Rotation.random(random_state=seed).as_matrix(), np.array([400.0, -90.0, 70.0]))
    return PaintedScan(bodies.moved(scan.scan, motion), scan.colouring, scan.stuck), motion


def printed(sticker: Sticker, pixels: int = 6) -> np.ndarray:
    """The sticker as a picture, white around."""
    return (
        np.pad(np.where(sticker.cells(), 10, 240).astype(np.uint8), 2, constant_values=240)
        .repeat(pixels, 0)
        .repeat(pixels, 1)
    )


@pytest.mark.parametrize("sticker", STICKERS, ids=lambda one: f"{one.size} {one.bone}")
def test_what_is_printed_is_read_as_what_it_is_and_its_mirror_image_as_mirrored(sticker: Sticker) -> None:
    for quarter in range(4):
        picture = np.rot90(printed(sticker), quarter)
        seen, backwards = marks_in(picture), marks_in(picture[:, ::-1])
        assert [(one.sticker, one.squares_off, one.is_mirrored) for one in seen] == [(sticker, 0, False)]
        assert [(one.sticker, one.squares_off, one.is_mirrored) for one in backwards] == [(sticker, 0, True)]


def test_no_sticker_is_near_the_mirror_image_of_any_or_near_another() -> None:
    def differ(one: np.ndarray, other: np.ndarray) -> int:
        return min(int((np.rot90(one, quarter) != other).sum()) for quarter in range(4))

    for one in STICKERS:
        for other in STICKERS:
            assert differ(one.cells()[:, ::-1], other.cells()) >= 7
            assert one is other or differ(one.cells(), other.cells()) >= 9


@pytest.mark.parametrize("sticker", STICKERS, ids=lambda one: f"{one.size} {one.bone}")
def test_the_mark_has_white_all_round_it(sticker: Sticker) -> None:
    assert white_between(sticker) > 0.5
    assert (sticker.cells()[[0, -1]].all() and sticker.cells()[:, [0, -1]].all(), MARK_CELLS) == (True, 7)


@pytest.mark.parametrize("seed", range(4))
def test_both_stickers_are_found_whichever_way_the_scan_lies(seed: int) -> None:
    scan, motion = turned(painted(size=0.6 + 0.15 * seed, seed=seed), seed)
    seen = {one.sticker.bone: one for one in found(scan)}
    assert set(seen) == set(BONES)
    for stuck in scan.stuck:
        one = seen[stuck.sticker.bone]
        assert np.linalg.norm(one.position - motion.apply(stuck.position)) < 2.0
        assert abs(one.scale - 1) < 0.03
        assert one.normal @ motion.turn(stuck.normal) > 0.95
        assert not one.is_mirrored


def test_small_stickers_are_found_on_a_baby() -> None:
    stuck = stuck_on(0.36, kind="small")
    seen = found(painted(0.36, stuck))
    assert {(one.sticker.bone, one.sticker.size) for one in seen} == {(bone, "small") for bone in BONES}
    assert all(abs(one.scale - 1) < 0.03 for one in seen)


@pytest.mark.parametrize("wound_again", [False, True])
@pytest.mark.parametrize("seed", range(2))
def test_on_a_mirrored_scan_every_sticker_reads_backwards(seed: int, wound_again: bool) -> None:
    seen = found(turned(painted(seed=seed).mirrored(wound_again), seed)[0])
    assert {one.sticker.bone for one in seen} == set(BONES)
    assert all(one.is_mirrored for one in seen)


def test_a_cloud_of_coloured_points_will_do() -> None:
    scan = painted_points()
    seen = {one.sticker.bone: one for one in found(scan)}
    assert set(seen) == set(BONES)
    for stuck in scan.stuck:
        assert np.linalg.norm(seen[stuck.sticker.bone].position - stuck.position) < 2.0


def test_one_sticker_is_found_alone() -> None:
    seen = found(painted(stuck=stuck_on(1.0, ("xiphisternum",))))
    assert [one.sticker.bone for one in seen] == ["xiphisternum"]


@pytest.mark.parametrize("factor", [0.1, 1.25, 10.0])
def test_the_scale_tells_how_far_the_size_is_from_true(factor: float) -> None:
    scan = painted()
    cleaned, growth = scan.cleaned(), Similarity(factor, np.eye(3), np.zeros(3))
    surface = Surface(growth.apply(scan.scan.surface.vertices), scan.scan.surface.triangles)
    seen = find_stickers(surface, scan.colouring, cleaned.moved(growth))
    assert len(seen) == 2
    assert all(abs(one.scale / factor - 1) < 0.03 for one in seen)


@pytest.mark.parametrize("seed", range(4))
def test_bare_skin_shows_no_sticker(seed: int) -> None:
    assert found(painted(stuck=(), seed=seed)) == ()


def test_noise_shows_no_sticker() -> None:
    random = np.random.default_rng(3)
    for cell in (1, 3, 6, 12):
        coarse = random.integers(0, 256, (480 // cell, 480 // cell), dtype=np.uint8)
        assert marks_in(coarse.repeat(cell, 0).repeat(cell, 1)) == []


def test_a_view_shows_the_skin_as_one_who_stands_before_it_sees_it() -> None:
    scan = painted(noise_mm=0.0)
    cleaned = scan.cleaned()
    skin = ColouredSkin(scan.scan.surface, scan.colouring, cleaned.points, cleaned.normals)
    picture = skin.seen(View(scan.stuck[0].position, towards(np.array([0.0, 0.0, 1.0])), 1.0, 81, 81))
    axes = towards(np.array([0.0, 0.0, 1.0]))
    right = np.nanmean(picture.points[:, -1], axis=0) - np.nanmean(picture.points[:, 0], axis=0)
    down = np.nanmean(picture.points[-1], axis=0) - np.nanmean(picture.points[0], axis=0)
    assert np.cross(right, down)[2] < 0  # right x down leads into the body
    assert right @ axes[0] > 79
    assert down @ axes[1] > 79


def seamed(scan: PaintedScan, bone: str, shift_mm: float) -> PaintedScan:
    """With a seam of the texture through the sticker on a bone: left of it the picture lies lower."""
    assert scan.colouring.corners is not None
    place = next(one.position for one in scan.stuck if one.sticker.bone == bone)
    middles = scan.scan.surface.vertices[scan.scan.surface.triangles].mean(axis=1)
    is_left = (middles[:, 0] < place[0]) & (np.abs(middles[:, 1] - place[1]) < 60)
    height = float(np.ptp(scan.scan.surface.vertices[:, 1]))
    corners = scan.colouring.corners.copy()
    corners[is_left, :, 1] += np.float32(shift_mm / height)
    return replace(scan, colouring=replace(scan.colouring, corners=corners))


@pytest.mark.parametrize(("bone", "shift_mm"), [("suprasternal_notch", 2.0), ("xiphisternum", 3.0)])
def test_a_sticker_cut_in_two_by_a_seam_is_found_when_the_other_one_is_whole(bone: str, shift_mm: float) -> None:
    scan = seamed(painted(), bone, shift_mm)
    seen = {one.sticker.bone: one for one in found(scan)}
    assert set(seen) == set(BONES)
    place = next(one.position for one in scan.stuck if one.sticker.bone == bone)
    assert np.linalg.norm(seen[bone].position - place) < 5.0


def test_the_second_look_imagines_nothing_where_one_sticker_was_put() -> None:
    for seed in range(2):
        seen = found(painted(stuck=stuck_on(1.0, (BONES[seed % 2],)), seed=seed))
        assert [one.sticker.bone for one in seen] == [BONES[seed % 2]]
