"""What no method can undercut in the mean: how far areas lie from where the table puts them on bones known exactly.

No scan, no click and no noise are in it, only the spread between people. With both true bones it is what is left for
five landmarks. Without a click of a bone the best guess are the bones that usually lie under such a skin, here known
exactly too: what is left for a method that sees the skin alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lubdub.results import AREA_NAMES
from tests.benchmark import cohort
from tests.benchmark.experiment import Cell, Row, Table

TRUE_BONES = "true bones"
SKINS_BONES = "the skin's bones"


def floor_rows(seed: int, number: int) -> list[Row]:
    """A row for either kind of bones, of one of the people of a seed."""
    subject, person = cohort.draw_person(seed, number)
    rows: list[Row] = []
    for bones, usual in zip((TRUE_BONES, SKINS_BONES), subject.usual_areas, strict=True):
        off = np.linalg.norm(usual - subject.areas, axis=1)
        errors = {f"{area}_mm": round(float(mm), 3) for area, mm in zip(AREA_NAMES, off, strict=True)}
        rows.append({"case": person.name, "group": person.group, "floor": bones, **errors})
    return rows


def floors_of(rows: Sequence[Row]) -> dict[str, float]:
    """Bones -> mean of all areas of all people, mm."""
    return {bones: _mean(rows, bones) for bones in (TRUE_BONES, SKINS_BONES)}


def floors_table(rows: Sequence[Row]) -> Table:
    """A line for each group, and one for all."""
    groups = {"all": rows} | {
        group: [row for row in rows if row["group"] == group] for group in dict.fromkeys(row["group"] for row in rows)
    }
    lines = [(group, *floors_of(of_group).values()) for group, of_group in groups.items()]
    title = "What is left in the mean when the bones are known exactly, mm"
    return Table(title, ("group", TRUE_BONES, SKINS_BONES), lines)


def _mean(rows: Sequence[Row], bones: str) -> float:
    return float(np.mean([row[f"{area}_mm"] for row in rows if row["floor"] == bones for area in AREA_NAMES]))


COMPARED: Mapping[str, tuple[str, str, str]] = {
    "lubdub five / rule five": ("lubdub, five", "rule, five", TRUE_BONES),
    "lubdub five / paper five": ("lubdub, five", "paper, five", TRUE_BONES),
    "lubdub three / paper three": ("lubdub, paper's three", "paper, paper's three", SKINS_BONES),
}
"""What the claims compare: a run, a baseline, and the bones whose floor is the least the run can come to."""


def ratios(means: Mapping[str, float], floors: Mapping[str, float]) -> dict[str, tuple[float, float | None]]:
    """Comparison -> one run's mean over another's, and the least this can be; None without floors."""
    return {
        name: (means[run] / means[baseline], floors[bones] / means[baseline] if floors else None)
        for name, (run, baseline, bones) in COMPARED.items()
        if run in means and baseline in means
    }


def ratios_table(found: Mapping[str, tuple[float, float | None]]) -> Table:
    """A line for each comparison."""
    lines: list[tuple[Cell, ...]] = [(name, *both) for name, both in found.items()]
    return Table("One mean error over another", ("runs", "ratio", "least possible"), lines)
