import json
from pathlib import Path

import pytest

from tests.benchmark.__main__ import EXPERIMENTS, main
from tests.benchmark.experiment import Experiment, Report, Row, Table, Unit
from tests.benchmark.runner import run_experiment


class Counted:
    """Units that count how often they were worked out; the second one breaks until it is repaired."""

    def __init__(self) -> None:
        self.done: list[str] = []
        self.broken = True

    def units(self, size: int, seed: int) -> list[Unit]:
        return [Unit(f"{seed} {number}", lambda number=number: self.work(number)) for number in range(size)]

    def work(self, number: int) -> list[Row]:
        if number == 1 and self.broken:
            raise KeyboardInterrupt
        self.done.append(str(number))
        return [{"number": number, "square": number**2}]


def squares(rows: list[Row]) -> Report:
    table = Table("Squares", ("number", "square"), [(row["number"], float(row["square"])) for row in rows])
    return Report((table,), {"largest": max(row["square"] for row in rows)}, {"line": _draw})


def _draw(figure) -> None:
    figure.subplots().plot([0, 1], [0, 1])


@pytest.fixture
def counted() -> Counted:
    return Counted()


@pytest.fixture
def experiment(counted: Counted) -> Experiment:
    return Experiment("squares", "squares", 3, "numbers", counted.units, squares)


def test_an_interrupted_run_goes_on_where_it_stopped(experiment, counted, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_experiment(experiment, 3, 1, tmp_path)
    counted.broken = False
    run_experiment(experiment, 3, 1, tmp_path)
    assert counted.done == ["0", "1", "2"]


def test_an_interrupted_run_of_another_seed_is_not_mixed_in(experiment, counted, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_experiment(experiment, 3, 1, tmp_path)
    counted.broken = False
    run_experiment(experiment, 3, 2, tmp_path)
    assert counted.done == ["0", "0", "1", "2"]


def test_a_torn_last_line_costs_only_its_own_unit(experiment, counted, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_experiment(experiment, 3, 1, tmp_path)
    counted.broken = False
    with (tmp_path / "squares.partial.jsonl").open("a") as journal:
        journal.write('{"key": "1 1", "ro')
    run_experiment(experiment, 3, 1, tmp_path)
    assert counted.done == ["0", "1", "2"]


def test_a_complete_run_leaves_json_csv_words_and_plots_and_no_journal(experiment, counted, tmp_path: Path) -> None:
    counted.broken = False
    run_experiment(experiment, 3, 1, tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"squares.json", "squares.csv", "squares.md", "squares-line.png"}
    document = json.loads((tmp_path / "squares.json").read_text())
    assert (document["largest"], document["seed"], document["size"]) == (4, 1, 3)
    assert document["tables"]["Squares"]["rows"] == [[0, 0.0], [1, 1.0], [2, 4.0]]
    assert (tmp_path / "squares.csv").read_text().splitlines()[1] == "0,0"
    assert "| 2 | 4.00 |" in (tmp_path / "squares.md").read_text()


def test_a_wrong_name_is_told_with_the_right_ones_and_exit_code_two(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["nothing"])
    assert stop.value.code == 2
    assert "cohort" in capsys.readouterr().err


def test_no_size_below_one_is_taken(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["cohort", "--size", "0"])
    assert stop.value.code == 2
    assert "whole number" in capsys.readouterr().err


def test_every_experiment_can_list_its_units_without_working() -> None:
    for experiment in EXPERIMENTS:
        keys = [unit.key for unit in experiment.units(2, 1)]
        assert keys
        assert len(set(keys)) == len(keys)
