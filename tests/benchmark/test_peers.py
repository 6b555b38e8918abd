import functools

import numpy as np
import pytest

from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from lubdub.results import AREA_NAMES
from tests.benchmark import peers
from tests.benchmark.demo import demo_cases
from tests.benchmark.experiment import Row
from tests.benchmark.measure import Case
from tests.benchmark.peers import CONTENDERS, OURS, PEERS, Ground, ground_of, measured, report, shares_of


def row(contender: str, case: str, error: float, seconds: float) -> Row:
    errors = {f"{area}_mm": error for area in AREA_NAMES}
    return {"contender": contender, "case": case, "points": 25_000, "seconds": seconds, "cpu_s": seconds, **errors}


def demo_with_mesh_truth() -> Case:
    """A demo scan stands in for a cohort person: its true places serve as what the mesh would carry."""
    case = demo_cases()[-1]
    return Case(
        case.name,
        "",
        case.data,
        case.patient,
        case.clicks,
        case.landmarks,
        case.areas,
        case.mm_per_unit,
        mesh_clicks=case.clicks,
        mesh_areas=case.areas,
    )


@pytest.fixture(scope="module")
def ground() -> Ground:
    return ground_of(demo_with_mesh_truth(), load_library())


@pytest.mark.parametrize("name", [name for name in CONTENDERS if name != "trimesh nricp_amberg"])
def test_every_contender_carries_all_areas_to_about_the_right_place(name: str, ground: Ground) -> None:
    (found,) = measured(lambda: ground, name, 600)
    assert "failed" not in found
    assert peers.errors_of([found]).max() < 60
    assert found["seconds"] >= 0


def test_a_registration_brings_areas_nearer_than_the_rigid_start_of_another_body(ground: Ground) -> None:
    start, ours = (peers.errors_of(measured(lambda: ground, name, 600)) for name in ("rigid start", OURS))
    assert ours.mean() < start.mean() + 5


def test_a_peer_that_breaks_down_is_a_row_without_numbers(ground: Ground, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(ground: Ground, vertices: int) -> peers.Places:
        raise ValueError("singular")

    monkeypatch.setattr(peers, "CONTENDERS", {PEERS[0]: broken})
    rows = measured(lambda: ground, PEERS[0], 600)
    assert rows[0]["failed"] == "ValueError: singular"
    assert list(report(rows).tables[0].rows[0][:3]) == [PEERS[0], 0, 1]


def test_only_cases_that_both_finished_are_compared() -> None:
    theirs = PEERS[0]
    rows = [row(OURS, "a", 2.0, 0.2), row(OURS, "b", 50.0, 0.2), row(theirs, "a", 8.0, 40.0)]
    rows.append({"contender": theirs, "case": "b", "failed": "ValueError"})
    assert shares_of(rows, OURS, theirs) == (1, pytest.approx(0.25), "0.0050", "0.0050", "yes")
    assert shares_of(rows[:2], OURS, theirs) == (0, None, None, None, None)


@pytest.mark.parametrize(("error", "seconds"), [(7.0, 0.2), (2.0, 1.0)])
def test_a_promise_that_was_not_kept_is_said(error: float, seconds: float) -> None:
    rows = [row("rigid start", "a", 9.0, 0.0), row(OURS, "a", error, seconds), row(PEERS[0], "a", 8.0, 40.0)]
    assert report(rows).tables[1].rows[0][-1] == "no"


def test_landmarks_reach_trimesh_as_triangles_and_weights() -> None:
    corners = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0], [10, 10, 0]])
    square = Surface(corners, np.array([[0, 1, 2], [1, 3, 2]]))
    triangles, weights = peers._on_triangles(square, np.array([[9.0, 9.0, 1.0], [1.0, 2.0, 0.0]]))
    assert list(triangles) == [1, 0]
    carried = np.einsum("kc,kcd->kd", weights, corners[square.triangles[triangles]])
    assert np.allclose(carried, [[9, 9, 0], [1, 2, 0]])


def test_every_contender_and_person_is_a_unit_of_its_own() -> None:
    units = list(peers.PEERS_EXPERIMENT.units(3, 1))
    assert len({unit.key for unit in units}) == len(units) == 3 * len(CONTENDERS)
    assert all(isinstance(unit.work, functools.partial) for unit in units)
