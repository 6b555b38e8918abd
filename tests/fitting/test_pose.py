import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.fitting import pose
from lubdub.fitting.expected import STRICT, Span, expect
from lubdub.fitting.pose import PoseSettings, find_pose
from lubdub.fitting.shape import ShapeFitSettings
from lubdub.fitting.starts import resized
from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from tests.bodies import hide_side, only_belly, torso_scan
from tests.scanned import clean_scan

BASIS = load_library().basis


@pytest.mark.parametrize(("seed", "size"), [(0, 1.0), (1, 0.5)])
def test_an_unmarked_torso_of_another_origin_is_found_whichever_way_it_lies(seed: int, size: float) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    body = torso_scan(size=size).surface
    scan = clean_scan(Surface(body.vertices @ turn.T, body.triangles), turn[:, 2])
    found = find_pose(scan, BASIS)
    relative = Rotation.from_matrix(found.pose.body_from_basis.rotation @ turn.T)
    assert np.degrees(relative.magnitude()) < 15
    assert found.margin > 0.1


def test_a_larger_body_is_tried_at_the_notch_of_one_that_stuck_and_explained_too_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scan = clean_scan(torso_scan().surface, np.array([0.0, 0.0, 1.0]))
    whole = find_pose(scan, BASIS)
    small = resized(whole.pose, 1 / 1.45, whole.fit.landmarks["suprasternal_notch"])
    monkeypatch.setattr(pose, "_starts", lambda *_: [small])
    stuck = ShapeFitSettings(iterations=0)
    found = find_pose(scan, BASIS, PoseSettings(rough=stuck, full=stuck))
    assert found.pose.body_from_basis.scale == pytest.approx(whole.pose.body_from_basis.scale)


def test_a_belly_alone_is_no_body() -> None:
    body = only_belly(hide_side(torso_scan())).surface
    found = find_pose(clean_scan(body, np.array([0.0, 0.0, 1.0])), BASIS)
    whole = find_pose(clean_scan(torso_scan().surface, np.array([0.0, 0.0, 1.0])), BASIS)
    assert found.misfit_mm / found.pose.body_from_basis.scale > 2 * whole.misfit_mm / whole.pose.body_from_basis.scale


def hill(length: float, breadth: float, height: float) -> Surface:
    """A featureless hill that looks the same with its ends exchanged."""
    u, v = np.meshgrid(np.linspace(-1, 1, 90), np.linspace(-1, 1, 126))
    z = height * np.sqrt(np.clip(1 - 0.8 * v**2 - 0.9 * u**2, 0, None))
    corner = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    return Surface(np.stack([u * breadth / 2, v * length / 2, z], -1).reshape(-1, 3), triangles)


@pytest.mark.parametrize(("length", "breadth", "height"), [(260.0, 160.0, 60.0), (300.0, 170.0, 70.0)])
def test_what_looks_the_same_upside_down_is_explained_alike_by_both_turns(
    length: float, breadth: float, height: float
) -> None:
    scan = clean_scan(hill(length, breadth, height), np.array([0.0, 0.0, 1.0]), noise_mm=0.5)
    expected = expect(BASIS, 3.0, "male", Span(77.0, 12.0), STRICT)
    found = find_pose(scan, BASIS, expected=expected)
    assert found.margin < 0.1
