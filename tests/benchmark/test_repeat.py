import numpy as np
import pytest

from lubdub.results import AREA_NAMES
from references.make.cameras import SCANNERS
from tests.benchmark.cohort import cohort_case
from tests.benchmark.experiment import Row
from tests.benchmark.repeat import HANDS, axes_of, offsets, report, spread_mm


def row(hand: str, **shift: float) -> Row:
    gaps = {f"{name}_{axis}": shift.get(axis, 0.0) for name in AREA_NAMES for axis in "xyz"}
    return {"case": "a", "hand": hand, "verdict": "show", **gaps}


def test_a_constant_error_is_no_spread() -> None:
    hand = next(iter(HANDS))
    assert spread_mm([row(hand, x=7.0, y=-2.0)] * 5) == pytest.approx(0.0)


def test_the_spread_is_one_standard_deviation_in_space() -> None:
    hand = next(iter(HANDS))
    assert spread_mm([row(hand, x=3.0), row(hand, x=-3.0)]) == pytest.approx(np.sqrt(18))


def test_a_refused_scan_is_left_out_and_one_answer_has_no_spread() -> None:
    hand = next(iter(HANDS))
    assert spread_mm([row(hand), {"case": "a", "hand": hand, "verdict": "refuse"}]) is None
    assert report([row(hand)]).numbers["median_mm"][hand] is None


@pytest.mark.parametrize("scanner", SCANNERS)
def test_the_bodys_axes_are_found_in_every_file(scanner: str) -> None:
    case = cohort_case(2, 3, scanner=scanner)
    axes = axes_of(case)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    left = axes[0] @ (case.areas["mitral"] - case.areas["aortic"]) * case.mm_per_unit
    assert left > 30


def test_two_scans_of_one_person_agree_when_the_landmarks_are_the_true_ones() -> None:
    cases = [cohort_case(2, 3, scan, scanner) for scan, scanner in enumerate(list(SCANNERS)[:2])]
    spread = spread_mm(offsets(cases, "the true landmarks each time"))
    assert spread is not None
    assert spread < 8.0
