"""`./lubdub benchmark references`: the same people before and after one's own reference bodies and marks.

Before is the shipped library alone; after is the folder of one's own, named by `--references` or kept with the
service's data: bodies of signed cases, bodies switched off, areas that two clinicians marked. The people are the
cohort's, so the library is judged on nobody it knows. `paper` carries the chosen body's own areas and feels every
change; `lubdub` reads its places off the bones and only names the bodies most like the scan, so its errors must stay
as they were.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from lubdub.library.load import load_library
from lubdub.results import AREA_NAMES, Library
from tests.benchmark.cohort import cohort_case, group_of
from tests.benchmark.experiment import Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import Case, Run, groups_table, run_on, runs_table, shipped_library, summary

RUNS = (Run("paper", "paper's three"), Run("lubdub", "five"))
FELT_MM = 0.5
"""An area whose error changed by less counts as unchanged."""


def both_libraries(case: Callable[[], Case], own: Library) -> list[Row]:
    """Every run on one person, with the shipped library and with one's own."""
    made, rows = case(), []
    for when, library in (("before", shipped_library()), ("after", own)):
        for run in RUNS:
            row = run_on(made, run, library)
            rows.append({**row, "run": f"{run.name}: {when}", "method": run.name, "when": when, **held(library)})
    return rows


def held(library: Library) -> dict[str, int]:
    """What a library is made of. own: bodies of signed cases; marked: those whose areas two people placed."""
    return {
        "bodies": len(library.references),
        "own": sum("case" in one.card for one in library.references),
        "marked": sum(bool(one.spread_mm) for one in library.references),
    }


def report(rows: list[Row]) -> Report:
    """Errors before and after, and how many areas came nearer or went farther."""
    libraries = [
        (when, *(next(row[what] for row in rows if row["when"] == when) for what in ("bodies", "own", "marked")))
        for when in ("before", "after")
    ]
    runs = {
        name: summary([row for row in rows if row["run"] == name]) for name in dict.fromkeys(r["run"] for r in rows)
    }
    tables = (
        Table("The two libraries", ("library", "bodies", "of signed cases", "marked by two people"), libraries),
        runs_table("Errors in mm", rows),
        groups_table("Mean error in mm by group", rows, "mean_mm"),
        Table(
            "Areas by what the change did to them",
            ("method", "nearer", "unchanged", "farther", "mean change, mm"),
            [(method, *changed(rows, method)) for method in dict.fromkeys(row["method"] for row in rows)],
        ),
    )
    return Report(tables, {"runs": runs}, words=__doc__.split("\n", 2)[2] if __doc__ else "")


def changed(rows: Sequence[Row], method: str) -> tuple[int, int, int, float | None]:
    """Areas nearer the truth, unchanged, farther from it; and the mean change, mm. Of people shown both times."""
    of_method = [row for row in rows if row["method"] == method]
    before, after = ({row["case"]: row for row in of_method if row["when"] == when} for when in ("before", "after"))
    changes = np.array(
        [
            after[case][f"{name}_mm"] - row[f"{name}_mm"]
            for case, row in before.items()
            for name in AREA_NAMES
            if f"{name}_mm" in row and f"{name}_mm" in after[case]
        ]
    )
    counts = ((changes < -FELT_MM).sum(), (np.abs(changes) <= FELT_MM).sum(), (changes > FELT_MM).sum())
    return (*map(int, counts), float(changes.mean()) if len(changes) else None)  # type: ignore[return-value]


def experiment(folder: Path | None) -> Experiment:
    """Over the library in a folder. Raises LibraryDamaged."""
    own = load_library(folder)

    def units(size: int, seed: int) -> Iterable[Unit]:
        for number in range(size):
            case = functools.partial(cohort_case, seed, number)
            key = f"{own.sha256[:12]} {group_of(number).name} {number}"
            yield Unit(key, functools.partial(both_libraries, case, own))

    return Experiment(
        "references", "one's own reference bodies and marks, before and after", 20, "how many people", units, report
    )
