"""The experiments that ask one thing: how far is the shown place from the true one? `demo` and `cohort`."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lubdub.results import AREA_NAMES, LANDMARK_NAMES
from tests.benchmark.cohort import cohort_case, group_of
from tests.benchmark.demo import demo_cases
from tests.benchmark.experiment import Experiment, Report, Row, Table, Unit
from tests.benchmark.floors import floor_rows, floors_of, floors_table, ratios, ratios_table
from tests.benchmark.measure import (
    Case,
    Run,
    errors_of,
    groups_table,
    radii_of,
    run_on,
    runs_table,
    shipped_library,
    summary,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADLINE = Run("lubdub", "five")
WITH_CLICKS = (
    HEADLINE,
    Run("rule", "five"),
    Run("paper", "five"),
    Run("lubdub", "paper's three"),
    Run("rule", "paper's three"),
    Run("paper", "paper's three"),
)
NO_CLICKS = (Run("lubdub", "none"),)
FLOOR = (Run("rule", "true bones"),)
"""The ruler on the true bones. What is left of it without a scan, and so without its own frame, is in `floors`."""
MESH_ALONE = (Run("lubdub", "five", carried=True),)
"""The registration by itself: the areas its mesh carries, on people whose marks are fixed to the mesh."""


def run_all(case: Callable[[], Case], runs: Sequence[Run]) -> list[Row]:
    """Every run on one case."""
    made = case()
    return [run_on(made, run, shipped_library()) for run in runs]


def _demo_units(size: int, seed: int) -> Iterable[Unit]:
    runs = (*WITH_CLICKS, *NO_CLICKS)
    for case in demo_cases()[:size]:
        yield Unit(case.name, functools.partial(run_all, lambda case=case: case, runs))


def _cohort_units(size: int, seed: int) -> Iterable[Unit]:
    runs = (*WITH_CLICKS, *NO_CLICKS, *FLOOR, *MESH_ALONE)
    for number in range(size):
        case = functools.partial(cohort_case, seed, number)
        yield Unit(f"{group_of(number).name} {number}", functools.partial(_run_and_floors, case, runs, seed, number))


def _run_and_floors(case: Callable[[], Case], runs: Sequence[Run], seed: int, number: int) -> list[Row]:
    return run_all(case, runs) + floor_rows(seed, number)


def report(rows: list[Row]) -> Report:
    """`overall` is the default method with five landmarks; then every run, its groups, and the suggestions."""
    floors, rows = [row for row in rows if "floor" in row], [row for row in rows if "floor" not in row]
    headline = [row for row in rows if row["run"] == HEADLINE.name]
    unmarked = [row for row in rows if row["run"] == NO_CLICKS[0].name]
    runs = {
        name: summary([row for row in rows if row["run"] == name]) for name in dict.fromkeys(r["run"] for r in rows)
    }
    means = {name: numbers["mean_mm"] for name, numbers in runs.items() if numbers["mean_mm"]}
    compared = ratios(means, floors_of(floors) if floors else {})
    tables = (
        runs_table("Errors in mm", rows),
        ratios_table(compared),
        groups_table("Mean error in mm by group", rows, "mean_mm"),
        groups_table("Mean error in mm by camera", rows, "mean_mm", "camera"),
        groups_table("Share of true places inside their region, by group", rows, "held_share"),
        areas_table(headline),
        suggestions_table(unmarked),
        *([floors_table(floors)] if floors else []),
    )
    numbers: dict[str, Any] = {
        "overall": summary(headline),
        "runs": runs,
        "ratios": {name: round(ratio, 3) for name, (ratio, _) in compared.items()},
    }
    return Report(tables, numbers, {"errors": functools.partial(plot_errors, rows)})


def areas_table(rows: Sequence[Row]) -> Table:
    """Each area by itself: error, radius, and how often the region held the truth."""
    lines = []
    for area in AREA_NAMES:
        errors = np.array([row[f"{area}_mm"] for row in rows if f"{area}_mm" in row])
        radii = np.array([row[f"{area}_radius_mm"] for row in rows if f"{area}_mm" in row])
        if len(errors):
            held = float((errors <= radii).mean())
            lines.append((area, float(errors.mean()), float(errors.max()), float(np.median(radii)), held))
    columns = ("area", "mean_mm", "max_mm", "median radius_mm", "held_share")
    return Table(f"{HEADLINE.name}, by area", columns, lines)


def suggestions_table(rows: Sequence[Row]) -> Table:
    """How far landmarks that nobody clicked were suggested from the truth."""
    lines = []
    for name in LANDMARK_NAMES:
        off = np.array([row[f"{name}_off_mm"] for row in rows if f"{name}_off_mm" in row])
        if len(off):
            lines.append((name, len(off), float(np.median(off)), float(np.percentile(off, 95)), float(off.max())))
    return Table("Suggested landmarks, no click", ("landmark", "suggested", "median_mm", "p95_mm", "max_mm"), lines)


def plot_errors(rows: Sequence[Row], figure: Figure) -> None:
    """Cumulative share of areas by error, a curve for each run; and error against radius for the headline."""
    left, right = figure.subplots(1, 2)
    for name in dict.fromkeys(row["run"] for row in rows):
        errors = np.sort(errors_of([row for row in rows if row["run"] == name]))
        left.step(errors, np.arange(1, len(errors) + 1) / max(len(errors), 1), where="post", label=name)
    left.set(xlabel="error, mm", ylabel="share of areas", xlim=(0, 50), ylim=(0, 1))
    left.legend(fontsize=6)
    headline = [row for row in rows if row["run"] == HEADLINE.name]
    right.scatter(radii_of(headline), errors_of(headline), s=6)
    right.axline((0, 0), slope=1, color="grey", linewidth=1)
    right.set(xlabel="radius of the region, mm", ylabel="error, mm", title=HEADLINE.name)


DEMO = Experiment("demo", "the three demo scans, every method", 3, "how many of the scans", _demo_units, report)
COHORT = Experiment(
    "cohort", "unseen simulated people, bones drawn under the skin", 200, "how many people", _cohort_units, report
)
