"""What one's own reference bodies and marks change, on the same people."""

from __future__ import annotations

from pathlib import Path

import pytest

from lubdub.library.load import load_library
from lubdub.library.marks import AreaMarks, Step, write_marks
from lubdub.results import AREA_NAMES, Library
from tests.benchmark.__main__ import main
from tests.benchmark.demo import demo_cases
from tests.benchmark.experiment import Row
from tests.benchmark.references import both_libraries, changed, report


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Every shipped body marked by two people 16 mm apart, both too far to the left."""
    folder = tmp_path_factory.mktemp("ours")
    for body in load_library().references:
        for who, aside in (("mori", 8.0), ("silva", 24.0)):
            steps = tuple(Step(name, body.areas[name] + [aside, 0.0, 0.0]) for name in AREA_NAMES)
            at = "2026-01-02T03:04:05+00:00"
            write_marks(folder, AreaMarks(body.id, body.card["sha256"], who, who, "t", steps, 4, at))
    return load_library(folder)


@pytest.fixture(scope="module")
def rows(own: Library) -> list[Row]:
    return both_libraries(lambda: demo_cases()[0], own)


def test_marks_move_what_is_carried_and_leave_what_is_read_off_the_bones(rows: list[Row]) -> None:
    assert [row["run"] for row in rows] == [
        "paper, paper's three: before",
        "lubdub, five: before",
        "paper, paper's three: after",
        "lubdub, five: after",
    ]
    paper, bones = (changed(rows, name) for name in ("paper, paper's three", "lubdub, five"))
    assert paper[0] + paper[2] > 0
    assert bones == (0, 4, 0, 0.0)


def test_regions_grow_where_people_disagree(rows: list[Row]) -> None:
    before, after = rows[0], rows[2]
    assert all(after[f"{name}_radius_mm"] > before[f"{name}_radius_mm"] for name in AREA_NAMES)


def test_the_report_says_what_the_two_libraries_held(rows: list[Row], own: Library) -> None:
    tables = {table.title: table.rows for table in report(rows).tables}
    count = len(own.references)
    assert tables["The two libraries"] == [("before", count, 0, 0), ("after", count, 0, count)]
    assert len(tables["Errors in mm"]) == 4


def test_without_anything_of_ones_own_a_sentence_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("LUBDUB_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.delenv("LUBDUB_REFERENCES_DIR", raising=False)
    for words in (["references"], ["references", "--references", str(tmp_path / "nowhere")]):
        with pytest.raises(SystemExit) as stop:
            main(words)
        assert stop.value.code == 2
        assert "reference bodies" in capsys.readouterr().err
