"""`./lubdub benchmark calibration`: do regions that should hold the true place 9 times in 10 do so?

On people the regions were not tuned on. For each area, each group and each set of landmarks: the share held with its
95 % interval (Wilson 1927), the median radius, and the conformal factor: what all radii would have to be multiplied
with so that nine in ten of these places are held (Vovk et al. 2005, split conformal with the score error / radius).
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from lubdub.results import AREA_NAMES
from tests.benchmark.accuracy import run_all
from tests.benchmark.cohort import cohort_case, group_of
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import Run, errors_of, radii_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RUNS = (Run("lubdub", "five"), Run("lubdub", "paper's three"), Run("lubdub", "none"))
HELD = 0.9
NUMBERS = ("places", "held_share", "lowest", "highest", "median radius_mm", "conformal factor")


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(size):
        case = functools.partial(cohort_case, seed, number)
        yield Unit(f"{group_of(number).name} {number}", functools.partial(run_all, case, RUNS))


def report(rows: list[Row]) -> Report:
    """A table for the landmark sets, and for five landmarks one by area and one by group."""
    five = [row for row in rows if row["run"] == RUNS[0].name]
    runs = {run.name: [row for row in rows if row["run"] == run.name] for run in RUNS}
    groups = {
        group: [row for row in five if row["group"] == group] for group in dict.fromkeys(r["group"] for r in five)
    }
    areas = {area: [_only(row, area) for row in five] for area in AREA_NAMES}
    tables = (
        _table("By landmarks", "run", runs),
        _table(f"{RUNS[0].name}, by area", "area", areas),
        _table(f"{RUNS[0].name}, by group", "group", groups),
    )
    return Report(tables, {"held": HELD}, {"curves": functools.partial(_draw, runs)})


def _only(row: Row, area: str) -> Row:
    return {key: value for key, value in row.items() if key.startswith(area)}


def _table(title: str, first: str, parts: dict[str, list[Row]]) -> Table:
    return Table(title, (first, *NUMBERS), [(name, *numbers(rows)) for name, rows in parts.items()])


def numbers(rows: Sequence[Row]) -> tuple[Cell, ...]:
    """What `NUMBERS` names."""
    errors, radii = errors_of(rows), radii_of(rows)
    if not len(errors):
        return (0, None, None, None, None, None)
    share = float((errors <= radii).mean())
    low, high = wilson(share, len(errors))
    return (len(errors), share, low, high, float(np.median(radii)), conformal_factor(errors / radii))


def wilson(share: float, count: int, z: float = 1.96) -> tuple[float, float]:
    """95 % interval of a share seen in `count` tries."""
    centre = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * np.sqrt(share * (1 - share) / count + z * z / (4 * count**2))
    return float(centre - half), float(centre + half)


def conformal_factor(scores: np.ndarray, held: float = HELD) -> float:
    """The ceil((n + 1) * held)-th smallest of n scores; infinite when n is too small for that."""
    rank = int(np.ceil((len(scores) + 1) * held))
    return float(np.sort(scores)[rank - 1]) if rank <= len(scores) else float("inf")


def _draw(runs: dict[str, list[Row]], figure: Figure) -> None:
    axes = figure.subplots()
    factors = np.linspace(0, 2.5, 101)
    for name, rows in runs.items():
        scores = errors_of(rows) / radii_of(rows)
        axes.plot(factors, [(scores <= factor).mean() if len(scores) else np.nan for factor in factors], label=name)
    axes.axvline(1.0, color="grey", linewidth=1)
    axes.axhline(HELD, color="grey", linewidth=1)
    axes.set(xlabel="radius multiplied by", ylabel="share of true places held", xlim=(0, 2.5), ylim=(0, 1))
    axes.legend()


CALIBRATION = Experiment(
    "calibration", "how often regions hold the true place, by area and group", 200, "how many people", _units, report
)
