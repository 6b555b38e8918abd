import numpy as np

from lubdub.scans.normals import neighbourhood
from lubdub.scans.thin import evenly


def test_neighbours_of_the_points_that_stay_are_as_if_the_others_had_never_been() -> None:
    random = np.random.default_rng(3)
    points = random.normal(size=(500, 3)) * [200.0, 300.0, 40.0]
    for share in (0.98, 0.5, 1.0):
        keep = random.random(len(points)) < share
        kept, fresh = neighbourhood(points).kept(keep, points), neighbourhood(points[keep])
        assert np.array_equal(kept.index, fresh.index)
        assert np.allclose(kept.reach, fresh.reach)


def test_fewer_points_than_neighbours_may_stay() -> None:
    points = np.random.default_rng(4).normal(size=(60, 3))
    keep = np.arange(60) < 9
    assert neighbourhood(points).kept(keep, points).index.shape == (9, 9)


def test_cubes_that_are_dropped_take_their_points_along_and_leave_the_means_of_others_alone() -> None:
    points = np.random.default_rng(5).normal(size=(4000, 3)) * 100
    cells = evenly(points, 700)
    keep = np.arange(cells.count) % 3 > 0
    kept = cells.kept(keep)
    assert kept.count == keep.sum()
    assert np.allclose(kept.mean(points[keep[cells.cell]]), cells.mean(points)[keep])
