"""`./lubdub benchmark paper`: the paper's experiments again, on simulated bodies like its own, beside what it printed.

Its Table 1 (one standard body bent onto eight others), its Table 3 (eight men, every one onto every other), its
Figure 3 (does the least Chamfer distance choose the least error?) and its Figure 4 (error on Chamfer distance).
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lubdub.results import AREA_NAMES
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.paper_bodies import BODIES, FACTS, OURS, work_software, work_volunteer
from tests.benchmark.paper_numbers import chosen, determination, does_not_add_up, printed_pairs
from tests.benchmark.paper_plots import plot_choice, plot_means, plot_regression

if TYPE_CHECKING:
    pass

WORDS = f"""# The paper's experiments, run again

{FACTS["citation"]}: the numbers called *printed* are its own, quoted as they stand. *Again* is its method as Lubdub
has it (`--method paper` with {25_000:,} points on both sides), on simulated bodies like its own; what it did on eight
real men cannot be repeated here. So look at the pattern, not at the digits:

- its Table 1: one standard body bent onto eight others. Ours are MakeHuman men of the same kinds, but number k is not
  the same body as the paper's number k. Their areas lie exactly where the anatomy table puts them, so here our
  methods show nothing but the error of the clicks;
- its Table 3: eight men with the statures and body mass indices of its volunteers, one noisy depth frame each from an
  overhead camera, nipples and navel marked with 5 mm error, every man registered onto every other. Bones and areas
  under the skin are drawn with the spread of anatomy, as they are in people: no registration of skin can see that part.
  *Areas that follow the skin* leaves it out: the same registrations, judged by where the skin would carry the areas if
  bones did not differ;
- our methods get two more landmarks, the breastbone's ends, 8 mm off. That is what they are made for;
- Chamfer distances differ in kind: the paper's are sums in a unit it does not name, ours mean distances in mm;
- in nine of the paper's 56 pairs the printed mean is not the mean of the four values beside it (marked *).
  Its printed coefficient of determination follows from the printed means;
- seconds are the paper's method's non-rigid ICP alone and our methods' whole runs, on a machine that had other work to
  do; the paper's are from other hardware and code. `./lubdub benchmark speed` is the place for seconds.
"""


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(1, len(BODIES)):
        yield Unit(f"body {number}", functools.partial(work_software, number))
    for group in range(size):
        for number in range(1, len(FACTS["volunteers"]) + 1):
            yield Unit(f"group {group}, man {number}", functools.partial(work_volunteer, seed, group, number))


def report(rows: list[Row]) -> Report:
    """Every table of the paper beside ours; numbers: the summary."""
    bodies = [row for row in rows if row["table"] == "bodies"]
    again = [row for row in rows if row["table"] == "pairs" and "reference" in row]
    ours = [row for row in rows if row["table"] == "pairs" and "run" in row]
    first = [row for row in again if row["group_of_eight"] == 0]
    tables = (
        summary_table(again, ours),
        bodies_table(bodies),
        choice_table(again),
        ours_table(ours),
        pairs_table(first),
        inconsistent_table(),
    )
    numbers: dict[str, Any] = {"summary": {line[0]: line[1:] for line in tables[0].rows}}
    plots = {
        "table-3": functools.partial(plot_means, again, ours),
        "figure-3": functools.partial(plot_choice, first),
        "figure-4": functools.partial(plot_regression, again),
    }
    return Report(tables, numbers, plots, WORDS + "\n" + findings(again, ours))


def findings(again: Sequence[Row], ours: Sequence[Row]) -> str:
    """What came out, in words with this run's numbers."""
    means = {run.name: [row["mean_mm"] for row in ours if row["run"] == run.name] for run in OURS}
    over = {name: np.mean([value for value in values if value is not None]) for name, values in means.items()}
    choice, chance = chosen(again, "mean_mm"), np.mean([row["mean_mm"] for row in again])
    by_chamfer, least = (np.mean([one[key] for one in choice]) for key in ("chosen_mm", "best_mm"))
    on_skin, with_bones = (determination(again, error)[0] for error in ("skin_mm", "mean_mm"))
    return f"""What came out:

- As the paper found, the more alike two bodies are the better one is registered onto the other: on the skin Chamfer
  distance explains {on_skin:.0%} of the variance of the error. Of the error that counts, bones and all, it explains
  {with_bones:.0%}: the least Chamfer distance chose references with {by_chamfer:.1f} mm, a reference drawn at random
  has {chance:.1f} mm, the best one for each man {least:.1f} mm.
- With two bone points more, `lubdub` is {over["lubdub, five"]:.1f} mm off on the same scans, the anatomy table as a
  ruler {over["rule, five"]:.1f} mm. The paper's method with the shipped bodies is
  {over["paper, paper's three"]:.1f} mm off.
"""


def summary_table(again: Sequence[Row], ours: Sequence[Row]) -> Table:
    """One line for each way of doing it, over eight men."""
    printed = printed_pairs()
    lines: list[tuple[Cell, ...]] = [
        _summary("printed, as printed", printed, "mean_mm"),
        _summary("printed, means recomputed", printed, "four_mm"),
        _summary("again", again, "mean_mm"),
        _summary("again, areas that follow the skin", again, "skin_mm"),
    ]
    for run in OURS:
        means = [row["mean_mm"] for row in ours if row["run"] == run.name and row["mean_mm"] is not None]
        seconds = float(np.median([row["seconds"] for row in ours if row["run"] == run.name]))
        what = "paper, choosing of the shipped 34" if run.name.startswith("paper") else f"{run.name} landmarks"
        worst = float(np.max(means)) if means else None
        lines.append((what, float(np.mean(means)) if means else None, worst, *(None,) * 6, seconds))
    columns = ("method", "mean of all_mm", "worst_mm", "least Chamfer_mm", "least error_mm", "random_mm")
    return Table(
        "Eight men: mean errors over the four areas, in mm",
        (*columns, "choice = best", "R2", "slope, mm a unit", "time_s"),
        lines,
    )


def _summary(what: str, rows: Sequence[Row], error: str) -> tuple[Cell, ...]:
    """random: a reference drawn at random is the mean of all. time: of the non-rigid ICP alone, as in the paper."""
    errors, choice = np.array([row[error] for row in rows]), chosen(rows, error)
    seconds = float(np.median([row["seconds"] for row in rows])) if "seconds" in rows[0] else FACTS["runtime_s"]["mean"]
    right = f"{sum(one['right'] for one in choice)} of {len(choice)}"
    by_choice = [float(np.mean([one[key] for one in choice])) for key in ("chosen_mm", "best_mm")]
    mean = float(errors.mean())
    return (what, mean, float(errors.max()), *by_choice, mean, right, *determination(rows, error), seconds)


def bodies_table(rows: Sequence[Row]) -> Table:
    """The paper's Table 1 beside ours."""
    lines: list[tuple[Cell, ...]] = []
    for number, printed in enumerate(FACTS["bodies"], start=1):
        of_body = {row.get("run", "again"): row for row in rows if row["number"] == number}
        if again := of_body.get("again"):
            areas = (again[f"{name}_mm"] for name in AREA_NAMES)
            means = (of_body[run.name]["mean_mm"] for run in OURS[:2])
            lines.append(
                (f"#{number}", *printed[5:7], BODIES[number][0], *areas, again["mean_mm"], again["chamfer_mm"], *means)
            )
    if lines:
        over = [np.mean([line[place] for line in lines]) for place in (1, 2, *range(4, 12))]
        lines.append(("mean", *map(float, over[:2]), "", *map(float, over[2:])))
    again_columns = (*(f"{name}_mm" for name in AREA_NAMES), "mean_mm", "Chamfer_mm")
    columns = ("body", "printed mean_mm", "printed Chamfer", "again: body", *again_columns)
    return Table(
        "Table 1: the standard body bent onto eight others",
        (*columns, *(f"{run.name}, mean_mm" for run in OURS[:2])),
        lines,
    )


def choice_table(again: Sequence[Row]) -> Table:
    """The paper's Figure 3 as a table: what the least Chamfer distance chooses."""
    sides = [
        chosen(printed_pairs(), "four_mm"),
        chosen([row for row in again if row["group_of_eight"] == 0], "mean_mm"),
    ]
    lines = [
        (
            p["scan"],
            p["chosen"],
            p["chosen_mm"],
            p["best"],
            p["best_mm"],
            a["chosen"],
            a["chosen_mm"],
            a["best"],
            a["best_mm"],
        )
        for p, a in zip(*sides, strict=False)
    ]
    words = ("chosen", "its error_mm", "best", "its error_mm")
    columns = ("man", *(f"printed: {word}" for word in words), *(f"again: {word}" for word in words))
    return Table(
        "Figure 3: the reference of least Chamfer distance and the best one (means recomputed)", columns, lines
    )


def ours_table(ours: Sequence[Row]) -> Table:
    """Both our methods and the paper's with the shipped references, man by man."""
    lines = []
    for scan in dict.fromkeys((row["group_of_eight"], row["scan"]) for row in ours):
        of_scan = {row["run"]: row for row in ours if (row["group_of_eight"], row["scan"]) == scan}
        lines.append((scan[1], *(of_scan[run.name]["mean_mm"] if run.name in of_scan else None for run in OURS)))
    return Table(
        "The same eight men by our methods, mean over the four areas in mm", ("man", *(r.name for r in OURS)), lines
    )


def pairs_table(again: Sequence[Row]) -> Table:
    """The paper's Table 3 beside ours."""
    by_pair = {(row["scan"], row["reference"]): row for row in again}
    lines: list[tuple[Cell, ...]] = []
    for row in printed_pairs():
        found = by_pair.get((row["scan"], row["reference"]))
        star = "*" if does_not_add_up(row) else ""
        mine = [found[key] for key in ("chamfer_mm", "mean_mm", "mitral_mm", "start")] if found else [None] * 4
        pair = (f"{row['scan']} {row['reference']}", row["chamfer_mm"], f"{row['mean_mm']:.2f}{star}", row["four_mm"])
        lines.append((*pair, row["mitral_mm"], *mine))
    printed = ("Chamfer", "mean_mm", "mean of its four_mm", "mitral_mm")
    mine = ("Chamfer_mm", "mean_mm", "mitral_mm", "start by")
    columns = ("scan, reference", *(f"printed {word}" for word in printed), *(f"again {word}" for word in mine))
    return Table("Table 3: every man onto every other", columns, lines)


def inconsistent_table() -> Table:
    """The rows of the paper's Table 3 whose mean is not that of their values."""
    lines = [
        (f"{row['scan']} {row['reference']}", row["mean_mm"], row["four_mm"], row["mean_mm"] - row["four_mm"])
        for row in printed_pairs()
        if does_not_add_up(row)
    ]
    columns = ("scan, reference", "printed mean_mm", "mean of its four_mm", "difference_mm")
    return Table("Printed means that are not the mean of their own four values", columns, lines)


PAPER = Experiment(
    "paper",
    "the paper's experiments again, beside its printed numbers",
    1,
    "how many groups of eight men",
    _units,
    report,
)
