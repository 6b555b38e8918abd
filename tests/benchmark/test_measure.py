import numpy as np
import pytest

from lubdub.library.load import load_library
from tests.benchmark.accuracy import areas_table, report, suggestions_table
from tests.benchmark.demo import demo_cases
from tests.benchmark.experiment import Row
from tests.benchmark.measure import Run, errors_of, groups_table, radii_of, run_on, runs_table, summary


def row(verdict: str = "show", run: str = "lubdub, five", group: str = "men", **errors: float) -> Row:
    fields: Row = {"case": "a", "group": group, "camera": "", "run": run, "verdict": verdict, "seconds": 0.5}
    for name, error in errors.items():
        fields |= {f"{name}_mm": error, f"{name}_radius_mm": 20.0}
    return fields


FOUR = {"aortic": 1.0, "pulmonary": 2.0, "tricuspid": 3.0, "mitral": 30.0}


def test_no_error_is_clipped_or_dropped() -> None:
    numbers = summary([row(**FOUR), row("show_with_care", **FOUR)])
    assert numbers["mean_mm"] == pytest.approx(9.0)
    assert numbers["max_mm"] == 30.0
    assert numbers["mitral_mm"] == 30.0
    assert numbers["held_share"] == 0.75


def test_refused_runs_count_as_refused_not_as_good() -> None:
    numbers = summary([row(**FOUR), row("refuse")])
    assert numbers["refused_share"] == 0.5
    assert numbers["shown_share"] == 0.5


def test_only_what_is_shown_without_care_counts_as_shown() -> None:
    careful = {**FOUR, "mitral": 99.0}
    assert summary([row(**FOUR), row("show_with_care", **careful)])["max_shown_mm"] == 30.0


def test_a_run_that_was_always_refused_has_no_errors_but_is_counted() -> None:
    numbers = summary([row("refuse")])
    assert numbers["mean_mm"] is None
    assert numbers["runs"] == 1


def test_each_run_has_a_line_and_each_group_a_line() -> None:
    rows = [row(**FOUR), row(run="rule, five", **FOUR), row(group="women", **FOUR)]
    assert [line[0] for line in runs_table("", rows).rows] == ["lubdub, five", "rule, five"]
    groups = groups_table("", rows, "mean_mm")
    assert groups.columns == ("group", "lubdub, five", "rule, five")
    assert list(groups.rows[1]) == ["women", 9.0, None]


def test_the_report_compares_with_the_ruler_and_keeps_the_headline_apart() -> None:
    found = report([row(**FOUR), row(run="rule, five", **{name: 2 * error for name, error in FOUR.items()})])
    assert found.numbers["overall"]["mean_mm"] == pytest.approx(9.0)
    assert found.numbers["ratios"]["lubdub five / rule five"] == pytest.approx(0.5)


def test_areas_are_reported_one_by_one() -> None:
    assert areas_table([row(**FOUR)]).rows[3] == ("mitral", 30.0, 30.0, 20.0, 0.0)


def test_suggestions_are_measured_only_where_nothing_was_clicked() -> None:
    rows = [{**row(), "navel_off_mm": 4.0}, {**row(), "navel_off_mm": 8.0}]
    assert list(suggestions_table(rows).rows) == [("navel", 2, 6.0, pytest.approx(7.8), 8.0)]


@pytest.mark.parametrize("case", demo_cases(), ids=lambda case: case.name)
def test_every_demo_scan_is_shown_within_what_its_regions_promise(case) -> None:
    found = run_on(case, Run("lubdub", "five"), load_library())
    assert found["verdict"] == "show"
    assert errors_of([found]).max() < 28
    assert np.mean(errors_of([found]) <= radii_of([found])) >= 0.75
