import numpy as np
import pytest

from tests.benchmark.calibration import conformal_factor, numbers, report, wilson
from tests.benchmark.experiment import Row


def row(error: float, radius: float = 10.0, group: str = "men", run: str = "lubdub, five") -> Row:
    return {"run": run, "group": group, "aortic_mm": error, "aortic_radius_mm": radius}


def test_radii_scaled_by_the_conformal_factor_hold_nine_in_ten_of_new_places() -> None:
    random = np.random.default_rng(1)
    seen, new = np.abs(random.normal(size=(2, 5000)))
    assert (new <= conformal_factor(seen)).mean() == pytest.approx(0.9, abs=0.015)


def test_too_few_places_give_no_factor() -> None:
    assert conformal_factor(np.ones(8)) == float("inf")
    assert conformal_factor(np.arange(9.0)) == 8.0


def test_the_interval_shrinks_with_the_count_and_stays_within_0_and_1() -> None:
    few, many = wilson(0.9, 20), wilson(0.9, 2000)
    assert few[0] < many[0] < 0.9 < many[1] < few[1] <= 1
    assert wilson(1.0, 5)[1] <= 1.0 + 1e-12


def test_the_share_counts_places_inside_their_own_radius() -> None:
    assert numbers([row(5.0), row(15.0), row(15.0, 20.0)])[:2] == (3, pytest.approx(2 / 3))


def test_groups_areas_and_landmark_sets_each_have_a_line() -> None:
    rows = [row(5.0), row(5.0, group="women"), row(5.0, run="lubdub, none")]
    by_run, by_area, by_group = report(rows).tables
    assert [line[0] for line in by_run.rows] == ["lubdub, five", "lubdub, paper's three", "lubdub, none"]
    assert [line[0] for line in by_group.rows] == ["men", "women"]
    assert [line[1] for line in by_area.rows] == [2, 0, 0, 0]
