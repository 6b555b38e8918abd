import numpy as np
import pytest

from lubdub.fitting.matches import Matcher, MatchRules, Target

FRONT = np.array([0.0, 0, 1])


def matcher(**changes: float) -> Matcher:
    """Points every 10 mm along x, facing the front, the last one on the rim."""
    points = np.stack([np.arange(0.0, 60, 10), np.zeros(6), np.zeros(6)], axis=1)
    on_rim = np.arange(6) == 5
    rules = {"farthest": 30.0, "widest_angle_deg": 60.0, "skip_border": True} | changes
    return Matcher(Target(points, np.tile(FRONT, (6, 1)), on_rim), MatchRules(**rules))  # type: ignore[arg-type]


def test_a_vertex_is_matched_to_the_nearest_point() -> None:
    found = matcher().match(np.array([[12.0, 3, 4]]), FRONT[None])
    assert np.array_equal(found.points, [[10, 0, 0]])
    assert found.trusted.all()


def test_a_point_too_far_away_is_not_trusted() -> None:
    assert not matcher().match(np.array([[10.0, 0, 31]]), FRONT[None]).trusted.any()


@pytest.mark.parametrize(("degrees", "trusted"), [(55, True), (65, False), (180, False)])
def test_skin_that_faces_elsewhere_is_not_trusted(degrees: float, trusted: bool) -> None:
    angle = np.deg2rad(degrees)
    normal = np.array([[np.sin(angle), 0, np.cos(angle)]])
    assert matcher().match(np.array([[10.0, 0, 5]]), normal).trusted[0] == trusted


def test_the_rim_is_neither_trusted_nor_counted() -> None:
    vertices = np.array([[20.0, 0, 0], [30, 0, 29], [30, 0, 31], [58, 0, 0]])
    found = matcher().match(vertices, np.tile(FRONT, (4, 1)))
    assert found.trusted.tolist() == [True, True, False, False]
    assert found.share() == pytest.approx(2 / 3)
    assert matcher(skip_border=False).match(vertices, np.tile(FRONT, (4, 1))).trusted[3]
