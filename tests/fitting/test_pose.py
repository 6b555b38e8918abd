import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.fitting.pose import find_pose
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


def test_a_belly_alone_is_no_body() -> None:
    body = only_belly(hide_side(torso_scan())).surface
    found = find_pose(clean_scan(body, np.array([0.0, 0.0, 1.0])), BASIS)
    whole = find_pose(clean_scan(torso_scan().surface, np.array([0.0, 0.0, 1.0])), BASIS)
    assert found.misfit_mm / found.pose.body_from_basis.scale > 2 * whole.misfit_mm / whole.pose.body_from_basis.scale
