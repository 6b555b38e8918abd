import json
from pathlib import Path

import numpy as np
import pytest

from lubdub.scans.read import read_scan
from tests.benchmark import speed, stopwatch
from tests.benchmark.demo import DEMO
from tests.benchmark.experiment import Row
from tests.benchmark.speed import crowded_case, fine_case, report


def row(method: str, seconds: float, peak_mb: float = 300.0, name: str = "cleaned, 25,000 points") -> Row:
    times = {
        "seconds": seconds,
        "first_s": 2 * seconds,
        "cpu_s": seconds,
        "stages": {"read": 0.01, "clean": seconds, "fit": seconds},
    }
    return {"input": name, "method": method, "peak_mb": peak_mb, "verdict": "show", **times}


def test_the_median_turn_counts_and_the_largest_memory() -> None:
    rows = [row("lubdub", 0.3), row("lubdub", 0.4, 500.0), row("lubdub", 9.0), row("paper", 4.0)]
    seconds, limits, ratios, after_cleaning, stages = report(rows).tables
    assert seconds.rows[0][2] == 0.4
    assert limits.rows[0] == ("cleaned, 25,000 points", 0.4, 0.6, 500.0, 1024.0, "yes")
    assert ratios.rows[0][1] == pytest.approx(0.1)
    assert after_cleaning.rows[0][1] == pytest.approx(0.1)
    assert stages.rows[0][2] == 0.4


@pytest.mark.parametrize(("seconds", "peak_mb"), [(0.7, 300.0), (0.3, 1100.0)])
def test_a_limit_that_was_not_kept_is_said(seconds: float, peak_mb: float) -> None:
    assert report([row("lubdub", seconds, peak_mb), row("paper", 4.0)]).tables[1].rows[0][-1] == "no"


def test_inputs_have_as_many_points_and_triangles_as_they_say_and_are_always_the_same() -> None:
    points = read_scan(crowded_case(90_000).data).surface.vertices
    assert len(points) == 90_000
    assert np.array_equal(points, read_scan(crowded_case(90_000).data).surface.vertices)
    assert 20_000 <= len(read_scan(fine_case(20_000).data).surface.triangles) <= 20_003


def test_a_run_is_timed_and_weighed(tmp_path: Path) -> None:
    folder = DEMO / "scanner-woman"
    words = tmp_path / "words.json"
    clicks = json.loads((folder / "landmarks.json").read_text())
    words.write_text(json.dumps({"clicks": clicks, "age": 33, "sex": "female"}))
    found = stopwatch.run(folder / "scanner-woman.stl", words, "rule")
    assert found["seconds"] > 0
    assert sum(found["stages"].values()) <= found["seconds"]
    assert found["peak_mb"] > 50
    assert found["verdict"] in ("show", "show_with_care", "refuse")


def test_every_input_and_method_is_a_unit_of_its_own_and_they_take_turns() -> None:
    keys = [unit.key for unit in speed.SPEED.units(2, 1)]
    assert len(keys) == len(set(keys)) == 2 * len(speed.INPUTS) * len(speed.METHODS)
    assert [key.split()[0] for key in keys] == ["0"] * (len(keys) // 2) + ["1"] * (len(keys) // 2)
