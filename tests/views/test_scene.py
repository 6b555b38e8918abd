"""What stands where in the 3D picture."""

from __future__ import annotations

import numpy as np
import pytest
import viser
from scipy.spatial import cKDTree

from lubdub.geometry.raycast import SkinCaster
from lubdub.results import AREA_NAMES, LANDMARK_NAMES
from lubdub.views.framing import FIELD_OF_VIEW, framed
from lubdub.views.placing import NUMBERS
from lubdub.views.scene import (
    VIEW,
    chestpiece_mm,
    draped_circle,
    draped_disc,
    show_body,
    show_landmarks,
    show_outcome,
)
from lubdub.views.stickers import AREA_STYLES, badge
from tests.views import sample


def position(server: viser.ViserServer, name: str) -> np.ndarray:
    handle = server.scene.get_handle_by_name(name)
    assert handle is not None, name
    return np.asarray(handle.position) / VIEW


def test_every_letter_lies_on_its_area(server: viser.ViserServer) -> None:
    outcome = sample.outcome()
    show_outcome(server, outcome, 6.0)
    for name in AREA_NAMES:
        assert np.linalg.norm(position(server, f"/areas/{name}/letter") - outcome.areas[name].position) < 5.0


def test_a_letter_is_upright_and_faces_the_front(server: viser.ViserServer) -> None:
    show_outcome(server, sample.outcome(), 6.0)
    for name in AREA_NAMES:
        handle = server.scene.get_handle_by_name(f"/areas/{name}/letter")
        assert handle is not None
        turned = viser.transforms.SO3(handle.wxyz).as_matrix()
        to_the_right, upward, outward = turned[:, 0], -turned[:, 1], -turned[:, 2]
        assert to_the_right[0] > 0.7
        assert upward[1] > 0.7
        assert outward[2] > 0.5


def test_the_plates_name_the_patients_own_sides(server: viser.ViserServer) -> None:
    show_body(server, sample.clean_scan(), sample.landmarks())
    assert position(server, "/sides/left")[0] > 30.0
    assert position(server, "/sides/right")[0] < -30.0


def test_pins_stand_on_their_landmarks(server: viser.ViserServer) -> None:
    landmarks = sample.landmarks("suggested")
    balls = show_landmarks(server.scene, landmarks, NUMBERS, 9.0)
    assert set(balls) == set(LANDMARK_NAMES)
    for name, mark in landmarks.items():
        np.testing.assert_allclose(position(server, f"/landmarks/{name}"), mark.position, atol=1e-3)


@pytest.mark.parametrize(("age", "diameter"), [(0.2, 26.0), (6.0, 33.0), (11.9, 33.0), (12.0, 44.0), (70.0, 44.0)])
def test_the_ring_has_the_size_of_the_chestpiece_for_the_age(age: float, diameter: float) -> None:
    assert chestpiece_mm(age) == diameter
    skin = SkinCaster(sample.clean_scan().display)
    area = sample.outcome().areas["pulmonary"]
    ring = draped_circle(skin, area.position, area.normal, diameter / 2)
    from_axis = np.linalg.norm(np.cross(ring - area.position, area.normal), axis=1)
    np.testing.assert_allclose(from_axis, diameter / 2, rtol=1e-6)


def test_rings_and_regions_lie_on_the_skin() -> None:
    scan = sample.clean_scan()
    skin, area = SkinCaster(scan.display), sample.outcome().areas["mitral"]
    vertices, triangles = draped_disc(skin, area.position, area.normal, 14.0)
    distance, _ = cKDTree(scan.display.vertices).query(vertices)
    assert distance.max() < 6.0
    assert triangles.max() == len(vertices) - 1


def test_the_four_areas_differ_in_shape_letter_and_colour() -> None:
    styles = AREA_STYLES.values()
    for property_ in ("shape", "letter", "number", "colour"):
        assert len({getattr(style, property_) for style in styles}) == 4
    pictures = [badge(style.shape, style.letter, style.colour, style.ink) for style in styles]
    outlines = {(picture[..., 3] > 128).tobytes() for picture in pictures}
    assert len(outlines) == 4


@pytest.mark.parametrize("aspect", [0.6, 0.85, 1.6])
def test_the_first_view_holds_everything_from_notch_to_navel(aspect: float) -> None:
    scan, landmarks = sample.clean_scan(), sample.landmarks()
    camera = framed(scan, landmarks, aspect)
    forward = camera.look_at - camera.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    half = np.tan(FIELD_OF_VIEW / 2)
    for mark in landmarks.values():
        seen = mark.position - camera.position
        depth = seen @ forward
        assert abs(seen @ upward) < half * depth
        assert abs(seen @ right) < half * aspect * depth
    assert forward[2] < -0.9
