"""The pieces the references are made with; none of these tests needs the downloaded source."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lubdub.fitting.expected import SEXES
from lubdub.geometry.surface import Surface
from references.make.anatomy import drop_on_skin, place_areas, sternum_mm
from references.make.basis import BUILD_AGES, coefficients_of, usual_builds
from references.make.fields import along_body, area_share, random_smooth_field, slide_on_skin, smooth_modes
from references.make.files import npz_bytes, rounded
from references.make.makehuman import modifier_target
from references.make.phenotype import Phenotype, draw_phenotype, median_stature
from references.make.scan import Camera, DepthNoise, camera_towards, in_fixed_order, simulate_depth_frame
from references.make.scene import sheet


def chest() -> Surface:
    """A gently curved sheet, 300 by 400 mm, facing the front."""
    x, y = np.linspace(-150, 150, 31), np.linspace(-300, 100, 41)
    return sheet(60 - 0.002 * x[None, :] ** 2 - 0.0005 * y[:, None] ** 2, x, y)


def test_an_archive_has_the_same_bytes_every_time_and_in_any_order() -> None:
    a, b = np.arange(6.0).reshape(2, 3), np.arange(4, dtype=np.int32)
    assert npz_bytes({"a": a, "b": b}) == npz_bytes({"b": b.copy(), "a": a.copy()})


def test_the_last_bits_of_a_sum_leave_no_trace_in_rounded_values() -> None:
    assert rounded(np.array([0.1 + 0.2]), 1 / 256) == rounded(np.array([0.3]), 1 / 256)


@given(st.integers(0, 2**32 - 1))
def test_the_same_seed_draws_the_same_person(seed: int) -> None:
    one, two = (draw_phenotype(np.random.default_rng(seed), 30.0, "female") for _ in range(2))
    assert one == two


@given(st.floats(0, 90), st.sampled_from(["female", "male"]))
def test_a_drawn_person_has_a_possible_stature(age: float, sex: str) -> None:
    person = draw_phenotype(np.random.default_rng(1), age, sex)  # type: ignore[arg-type]
    assert 0.85 < person.stature_mm / median_stature(age, sex) < 1.15  # type: ignore[arg-type]


def test_smooth_fields_and_modes_are_the_same_for_the_same_input() -> None:
    vertices, share = chest().vertices[::7], np.ones(len(chest().vertices[::7]))
    modes = [smooth_modes(place, share, 120, 6, 5) for place in (vertices, vertices.copy())]
    np.testing.assert_array_equal(*modes)
    fields = [random_smooth_field(np.random.default_rng(3), vertices, vertices, 120, 5) for _ in range(2)]
    np.testing.assert_array_equal(*fields)


def test_all_smooth_modes_together_move_points_by_the_stated_amount() -> None:
    vertices = chest().vertices[::7]
    modes = smooth_modes(vertices, np.linspace(0.2, 1.0, len(vertices)), 120, 6.0, 40)
    assert np.sqrt((modes**2).sum(axis=(0, 2)).mean()) == pytest.approx(6.0, rel=0.02)


def test_dense_vertices_count_for_the_little_skin_they_stand_for() -> None:
    x = np.concatenate([np.arange(0, 100, 10.0), np.arange(100, 105, 1.0), np.arange(110, 300, 10.0)])
    surface = sheet(np.zeros((30, len(x))), x, np.arange(0, 300, 10.0))
    share = area_share(surface.vertices, surface.triangles).reshape(30, -1)
    np.testing.assert_allclose(share[5, 11:14] / share[5, 4], 0.1, rtol=1e-6)
    assert share.max() == 1.0


def test_sliding_keeps_points_on_the_skin() -> None:
    surface = chest()
    inside = (np.abs(surface.vertices[:, 0]) < 100) & (surface.vertices[:, 1] > -200) & (surface.vertices[:, 1] < 50)
    shift = np.where(inside[:, None], [6.0, -11.0], 0.0)
    moved = (surface.vertices + slide_on_skin(surface.vertices, shift, np.ones(len(inside))))[inside]
    np.testing.assert_allclose(moved[:, 2], 60 - 0.002 * moved[:, 0] ** 2 - 0.0005 * moved[:, 1] ** 2, atol=0.1)


def test_a_profile_passes_its_knots_and_is_constant_beyond() -> None:
    profile = along_body(np.array([100.0, 50.0, 0.0, -120.0, -900.0]), (50.0, 0.0, -120.0), (0.0, 3.0, -8.0))
    np.testing.assert_allclose(profile, [0.0, 0.0, 3.0, -8.0, -8.0], atol=1e-9)


@given(st.floats(0.9, 1.1), st.floats(-0.3, 0.3), st.sampled_from([1.0, 5.0, 8.0, 40.0]))
def test_areas_turn_and_grow_with_the_bones(scale: float, turn: float, age: float) -> None:
    surface = chest()
    bones = np.array([[0.0, 0.0, 60.0], [0.0, -120.0, 50.0]])
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1.0]])
    plain = place_areas(surface.vertices, surface.triangles, bones, age).positions
    moved = place_areas(scale * surface.vertices @ rotation.T, surface.triangles, scale * bones @ rotation.T, age)
    np.testing.assert_allclose(moved.positions, scale * plain @ rotation.T, atol=1e-6)


def test_a_place_beside_the_skin_is_refused() -> None:
    surface = chest()
    with pytest.raises(ValueError, match="no skin"):
        drop_on_skin(np.array([[500.0, 0.0]]), surface.vertices, surface.triangles)


@pytest.mark.parametrize(
    ("age", "sex", "length"), [(1, "male", 66), (5, "male", 88), (10, "female", 109), (2, "female", 69)]
)
def test_a_childs_sternum_follows_the_measured_law(age: float, sex: str, length: float) -> None:
    assert sternum_mm(age, sex, median_stature(age, sex)) == pytest.approx(length, abs=1)  # type: ignore[arg-type]


@pytest.mark.parametrize(("sex", "length"), [("male", 150), ("female", 140)])
def test_an_average_adults_sternum(sex: str, length: float) -> None:
    assert sternum_mm(30, sex, median_stature(30, sex)) == pytest.approx(length)  # type: ignore[arg-type]


def test_modifiers_name_the_file_by_their_sign() -> None:
    assert modifier_target("breast/breast-trans", -0.2) == "breast/breast-trans-down"
    assert modifier_target("torso/torso-scale-depth", 0.2) == "torso/torso-scale-depth-incr"


def test_a_newborn_is_younger_than_the_youngest_anchor() -> None:
    assert Phenotype(0.0, "male", 500.0).makehuman_age < 0 < Phenotype(2.0, "male", 870.0).makehuman_age


def overhead() -> Camera:
    return camera_towards(np.array([20.0, -150.0, 700.0]), np.array([0.0, -100.0, 50.0]), np.array([0.0, 1.0, 0.0]))


def test_a_depth_frame_without_noise_lies_on_the_scene_and_in_camera_axes() -> None:
    clean = DepthNoise(sigma_mm=0.0, dropout=0.0, holes=(0, 1))
    surface, file_from_body = simulate_depth_frame(chest(), overhead(), np.random.default_rng(0), clean)
    assert (surface.vertices[:, 2] > 0).all()
    back = file_from_body.inverse().apply(surface.vertices)
    np.testing.assert_allclose(back[:, 2], 60 - 0.002 * back[:, 0] ** 2 - 0.0005 * back[:, 1] ** 2, atol=0.2)


def test_the_same_seed_gives_the_same_depth_frame() -> None:
    frames = [simulate_depth_frame(chest(), overhead(), np.random.default_rng(5))[0].vertices for _ in range(2)]
    np.testing.assert_array_equal(*frames)


@given(st.integers(0, 1000))
def test_a_surface_in_fixed_order_forgets_the_order_it_came_in(seed: int) -> None:
    surface, random = sheet(np.zeros((4, 4)), np.arange(4.0), np.arange(4.0)), np.random.default_rng(seed)
    order = random.permutation(len(surface.vertices))
    place = np.argsort(order)
    shuffled = Surface(surface.vertices[order], place[surface.triangles][random.permutation(len(surface.triangles))])
    one, two = in_fixed_order(surface), in_fixed_order(shuffled)
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.triangles, two.triangles)


def test_coefficients_of_modes_are_those_a_body_was_made_with() -> None:
    random = np.random.default_rng(5)
    share = random.uniform(0.2, 1.0, 30)
    rows = np.linalg.qr(random.normal(size=(90, 4)))[0].T
    modes = rows.reshape(4, 30, 3) * np.array([9.0, 5.0, 2.0, 1.0])[:, None, None] / np.sqrt(share)[:, None]
    made = random.normal(size=(7, 4))
    np.testing.assert_allclose(coefficients_of(np.einsum("bk,knd->bnd", made, modes), modes, share), made)


def test_usual_builds_are_found_again_in_people_drawn_around_them() -> None:
    random = np.random.default_rng(6)
    people = [Phenotype(random.uniform(0, 85), sex, 1700.0) for sex in SEXES for _ in range(6000)]
    rise = np.array([[0.03 if one.sex == "male" else -0.01] * 2 for one in people])
    ages = np.array([one.age_years for one in people])[:, None]
    noise = random.normal(size=(len(people), 2)) @ np.array([[0.5, 0.2], [0.0, 0.3]])
    builds = usual_builds(people, rise * ages + noise)
    np.testing.assert_allclose(builds.means[0], -0.01 * np.array(BUILD_AGES)[:, None] * [1, 1], atol=0.2)
    np.testing.assert_allclose(builds.means[1], 0.03 * np.array(BUILD_AGES)[:, None] * [1, 1], atol=0.2)
    np.testing.assert_allclose(builds.spread, [[0.25, 0.1], [0.1, 0.13]], atol=0.02)
