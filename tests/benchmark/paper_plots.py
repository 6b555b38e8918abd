"""The paper's figures again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tests.benchmark.experiment import Row
from tests.benchmark.paper_bodies import OURS
from tests.benchmark.paper_numbers import chosen, determination, printed_pairs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_means(again: Sequence[Row], ours: Sequence[Row], figure: Figure) -> None:
    """Every pair's mean error, printed and again, and our methods on the same men."""
    axes = figure.subplots()
    groups = {"printed": [row["four_mm"] for row in printed_pairs()], "again": [row["mean_mm"] for row in again]}
    groups |= {"again, least\nChamfer": [one["chosen_mm"] for one in chosen(again, "mean_mm")]}
    for run in OURS:
        name = "paper,\n34 references" if run.name.startswith("paper") else run.name.replace(", ", ",\n")
        groups[name] = [row["mean_mm"] for row in ours if row["run"] == run.name and row["mean_mm"] is not None]
    for place, values in enumerate(groups.values()):
        spread = place + np.linspace(-0.2, 0.2, max(len(values), 1))[: len(values)]
        axes.plot(spread, values, "o", markersize=4, alpha=0.7)
        axes.hlines(np.mean(values), place - 0.3, place + 0.3, color="black") if values else None
    axes.set_xticks(range(len(groups)), list(groups))
    axes.set(ylabel="mean error over the four areas, mm", title="Eight men (line: mean)", ylim=(0, None))


def plot_choice(again: Sequence[Row], figure: Figure) -> None:
    """A panel for each man: error on Chamfer distance of the seven references, the chosen one ringed."""
    panels = figure.subplots(2, 4, sharey=True).ravel()
    for panel, scan in zip(panels, dict.fromkeys(row["scan"] for row in again), strict=False):
        of_scan = [row for row in again if row["scan"] == scan]
        x, y = [row["chamfer_mm"] for row in of_scan], [row["mean_mm"] for row in of_scan]
        panel.plot(x, y, "o", markersize=4)
        nearest = int(np.argmin(x))
        panel.plot(x[nearest], y[nearest], "o", markersize=10, fillstyle="none", color="black")
        panel.set_title(f"{scan}", fontsize=9)
    figure.supxlabel("Chamfer distance, mm (ring: the one that is chosen)")
    figure.supylabel("mean error, mm")


def plot_regression(again: Sequence[Row], figure: Figure) -> None:
    """Error on Chamfer distance over all pairs: printed, again, and again with areas that follow the skin."""
    sides = (
        ("printed, recomputed", printed_pairs(), "four_mm"),
        ("again", again, "mean_mm"),
        ("again, on the skin", again, "skin_mm"),
    )
    for axes, (name, rows, error) in zip(figure.subplots(1, 3), sides, strict=True):
        x, y = np.array([row["chamfer_mm"] for row in rows]), np.array([row[error] for row in rows])
        axes.plot(x, y, "o", markersize=4)
        ends = np.array([x.min(), x.max()])
        axes.plot(ends, np.polyval(np.polyfit(x, y, 1), ends), color="grey")
        axes.set_title(f"{name}: R2 {determination(rows, error)[0]:.2f}", fontsize=9)
        axes.set(xlabel="Chamfer distance", ylabel="error, mm", ylim=(0, 65))
