import json

import numpy as np
import pytest

from lubdub.library.load import load_library
from tests.benchmark.__main__ import main, report, table
from tests.benchmark.demo import demo_cases
from tests.benchmark.measure import Row, run, summary


def row(errors: dict[str, float], verdict: str = "show", method: str = "lubdub") -> Row:
    return Row("a", "men", method, "five", verdict, (), errors, dict.fromkeys(errors, True), 0.5)


FOUR = {"aortic": 1.0, "pulmonary": 2.0, "tricuspid": 3.0, "mitral": 30.0}


def test_no_error_is_clipped_or_dropped() -> None:
    numbers = summary([row(FOUR), row(FOUR, "show_with_care")])
    assert numbers["mean_mm"] == pytest.approx(9.0)
    assert numbers["max_mm"] == 30.0
    assert numbers["mitral_mm"] == 30.0


def test_refused_runs_count_as_refused_not_as_good() -> None:
    numbers = summary([row(FOUR), row({}, "refuse")])
    assert numbers["refused_share"] == 0.5
    assert numbers["shown_share"] == 0.5


def test_only_what_is_shown_without_care_counts_as_shown() -> None:
    careful = {**FOUR, "mitral": 99.0}
    assert summary([row(FOUR), row(careful, "show_with_care")])["max_shown_mm"] == 30.0


def test_the_table_has_one_line_for_each_method() -> None:
    document = report([row(FOUR), row(FOUR, method="rule")])
    assert document["overall"]["mean_mm"] == pytest.approx(9.0)
    assert table(document).count("\n") == 3


@pytest.mark.parametrize("case", demo_cases(), ids=lambda case: case.name)
def test_every_demo_scan_is_shown_within_what_its_regions_promise(case) -> None:
    found = run(case, "lubdub", "five", load_library())
    assert found.verdict == "show"
    assert max(found.errors_mm.values()) < 28
    assert np.mean(list(found.held.values())) >= 0.75


def test_a_wrong_name_is_one_line_and_exit_code_two(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["nothing"])
    assert stop.value.code == 2
    assert json.dumps("nothing")[1:-1] in capsys.readouterr().err
