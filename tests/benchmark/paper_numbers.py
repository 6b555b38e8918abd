"""The paper's printed pairs, and what is worked out from pairs, whoever's they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.benchmark.experiment import Row
from tests.benchmark.paper_bodies import FACTS

ADDS_UP_MM = 0.02
"""A printed mean may differ from the mean of its four printed values by rounding only."""


def printed_pairs() -> list[Row]:
    """The paper's Table 3. mean_mm: as printed; four_mm: the mean of the four values beside it."""
    rows = []
    for scan, reference, chamfer, *areas, mean in FACTS["pairs"]:
        row = {"scan": f"#{scan}", "reference": f"#{reference}", "chamfer_mm": chamfer, "mean_mm": mean}
        rows.append({**row, "four_mm": round(float(np.mean(areas)), 3), "mitral_mm": areas[3]})
    return rows


def does_not_add_up(row: Row) -> bool:
    """Whether a printed mean is not the mean of its own values."""
    return abs(row["mean_mm"] - row["four_mm"]) > ADDS_UP_MM


def determination(rows: Sequence[Row], error: str) -> tuple[float, float]:
    """(R squared, slope) of the regression of an error on the Chamfer distance."""
    chamfer, errors = np.array([row["chamfer_mm"] for row in rows]), np.array([row[error] for row in rows])
    return float(np.corrcoef(chamfer, errors)[0, 1] ** 2), float(np.polyfit(chamfer, errors, 1)[0])


def chosen(rows: Sequence[Row], error: str) -> list[Row]:
    """For each scan: the reference of least Chamfer distance with its error, and the least error there was."""
    found = []
    for scan in dict.fromkeys((row.get("group_of_eight"), row["scan"]) for row in rows):
        of_scan = [row for row in rows if (row.get("group_of_eight"), row["scan"]) == scan]
        nearest, best = (min(of_scan, key=lambda row: row[key]) for key in ("chamfer_mm", error))
        line = {"scan": scan[1], "chosen": nearest["reference"], "chosen_mm": nearest[error]}
        found.append({**line, "best": best["reference"], "best_mm": best[error], "right": nearest is best})
    return found
