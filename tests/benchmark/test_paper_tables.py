"""The printed numbers stand as printed, and what is said about them follows from them."""

from __future__ import annotations

import numpy as np
import pytest

from lubdub.results import AREA_NAMES
from tests.benchmark.experiment import Row
from tests.benchmark.paper_bodies import BODIES, FACTS, OURS
from tests.benchmark.paper_numbers import chosen, determination, does_not_add_up, printed_pairs
from tests.benchmark.paper_tables import report


def pair(scan: str, reference: str, chamfer: float, error: float, group: int = 0) -> Row:
    areas = {f"{name}_mm": error for name in AREA_NAMES}
    row = {"table": "pairs", "group_of_eight": group, "scan": scan, "reference": reference, "chamfer_mm": chamfer}
    return {**row, **areas, "mean_mm": error, "skin_mm": error / 2, "start": "shape", "seconds": 4.0}


def by_ours(scan: str, run: str, error: float) -> Row:
    row = {"table": "pairs", "group_of_eight": 0, "scan": scan, "run": run, "seconds": 0.3}
    return {**row, "mean_mm": error}


def test_the_printed_tables_are_whole() -> None:
    assert len(FACTS["pairs"]) == 56
    assert {(row[0], row[1]) for row in FACTS["pairs"]} == {(i, j) for i in range(1, 9) for j in range(1, 9) if i != j}
    assert len(FACTS["bodies"]) == len(BODIES) - 1 == 8
    assert np.mean([pair[0] for pair in FACTS["volunteers"]]) == pytest.approx(1.73, abs=0.01)


def test_nine_printed_means_do_not_add_up() -> None:
    wrong = [(row["scan"], row["reference"]) for row in printed_pairs() if does_not_add_up(row)]
    assert len(wrong) == 9
    assert ("#6", "#8") in wrong


def test_the_printed_coefficient_of_determination_follows_from_the_printed_means_only() -> None:
    assert determination(printed_pairs(), "mean_mm")[0] == pytest.approx(FACTS["r2"], abs=0.005)
    assert determination(printed_pairs(), "four_mm")[0] == pytest.approx(0.53, abs=0.005)


def test_the_means_of_the_eight_software_bodies_add_up_as_printed() -> None:
    for body in FACTS["bodies"]:
        assert np.mean(body[1:5]) == pytest.approx(body[5], abs=0.02)


def test_the_chosen_reference_has_the_least_chamfer_distance_and_the_best_the_least_error() -> None:
    rows = [pair("#1", "#2", 3.0, 9.0), pair("#1", "#3", 2.0, 12.0), pair("#2", "#1", 1.0, 4.0)]
    first, second = chosen(rows, "mean_mm")
    assert (first["chosen"], first["chosen_mm"], first["best"], first["best_mm"]) == ("#3", 12.0, "#2", 9.0)
    assert not first["right"]
    assert second["right"]


def test_two_groups_of_eight_are_not_mixed_up() -> None:
    rows = [pair("#1", "#2", 3.0, 9.0), pair("#1", "#3", 2.0, 12.0, group=1)]
    assert [one["chosen"] for one in chosen(rows, "mean_mm")] == ["#2", "#3"]


def test_the_page_stands_printed_and_again_side_by_side() -> None:
    rows = [pair("#1", "#2", 3.0, 9.0), pair("#1", "#3", 2.0, 12.0), pair("#2", "#1", 1.0, 4.0)]
    rows += [by_ours("#1", run.name, 5.0) for run in OURS]
    found = report(rows)
    table = next(table for table in found.tables if table.title.startswith("Table 3"))
    assert len(table.rows) == 56
    assert table.rows[0][5:7] == (3.0, 9.0)
    assert str(next(row for row in table.rows if row[0] == "#6 #8")[2]).endswith("*")
    assert "nine of the paper's 56 pairs" in found.words
    assert "`lubdub` is 5.0 mm off" in found.words
    assert found.numbers["summary"]["again"][0] == pytest.approx(25 / 3)
    assert found.numbers["summary"]["again, areas that follow the skin"][0] == pytest.approx(25 / 6)
