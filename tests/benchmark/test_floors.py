import pytest

from tests.benchmark.accuracy import report
from tests.benchmark.experiment import Row
from tests.benchmark.floors import SKINS_BONES, TRUE_BONES, floor_rows, floors_of, floors_table, ratios
from tests.benchmark.test_measure import FOUR, row


def test_somebody_whose_areas_follow_the_table_on_the_true_bones_leaves_no_floor() -> None:
    rows = floor_rows(1, 3)
    assert floors_of(rows) == {TRUE_BONES: 0.0, SKINS_BONES: pytest.approx(10.0)}


def floor(bones: str, group: str, mm: float) -> Row:
    return {"case": "a", "group": group, "floor": bones, **{f"{area}_mm": mm for area in FOUR}}


ROWS = [floor(bones, group, mm) for group, mm in (("men", 4.0), ("women", 8.0)) for bones in (TRUE_BONES, SKINS_BONES)]


def test_the_floor_is_told_for_all_and_for_each_group() -> None:
    assert [tuple(line) for line in floors_table(ROWS).rows] == [
        ("all", 6.0, 6.0),
        ("men", 4.0, 4.0),
        ("women", 8.0, 8.0),
    ]


def test_a_ratio_stands_beside_the_least_it_can_be() -> None:
    found = ratios({"lubdub, five": 9.0, "rule, five": 12.0}, floors_of(ROWS))
    assert found == {"lubdub five / rule five": (0.75, 0.5)}


def test_a_run_is_compared_where_no_floor_is_known() -> None:
    assert ratios({"lubdub, five": 9.0, "rule, five": 12.0}, {}) == {"lubdub five / rule five": (0.75, None)}


def test_the_floor_is_no_run_and_changes_no_run_in_the_report() -> None:
    plain, with_floors = report([row(**FOUR)]), report([row(**FOUR), *ROWS])
    assert with_floors.numbers["runs"] == plain.numbers["runs"]
    assert with_floors.tables[-1].title.startswith("What is left")
