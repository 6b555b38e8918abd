"""`./lubdub benchmark repeat`: one person, five scans by other cameras at other moments: how far apart are they?"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from lubdub.geometry.frames import body_axes
from lubdub.pipeline import Request, locate
from lubdub.results import AREA_NAMES
from references.make.cameras import SCANNERS
from tests.benchmark.cohort import cohort_case, group_of
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import Case, shipped_library

HANDS = {"clicked again each time": False, "the true landmarks each time": True}
"""How the landmarks come about; with the true ones only the camera, the breath and the bed differ."""


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(size):
        yield Unit(f"{group_of(number).name} {number}", functools.partial(_work, seed, number))


def _work(seed: int, number: int) -> list[Row]:
    cases = [cohort_case(seed, number, scan, scanner) for scan, scanner in enumerate(SCANNERS)]
    return [row for hand in HANDS for row in offsets(cases, hand)]


def offsets(cases: Sequence[Case], hand: str) -> list[Row]:
    """A row for each scan that was not refused: shown minus true place in mm along the body's own axes."""
    rows = []
    for case in cases:
        clicks = case.landmarks if HANDS[hand] else case.clicks
        outcome = locate(case.data, Request(case.patient, clicks), shipped_library())
        row: Row = {"case": case.name, "group": case.group, "camera": case.camera, "hand": hand}
        if outcome.scan is not None:
            to_file = outcome.scan.body_from_file.inverse()
            for name, area in outcome.areas.items():
                gap = axes_of(case) @ (to_file.apply(area.position) - case.areas[name]) * case.mm_per_unit
                row |= {f"{name}_{axis}": round(float(value), 3) for axis, value in zip("xyz", gap, strict=True)}
        rows.append({**row, "verdict": outcome.verdict})
    return rows


def axes_of(case: Case) -> np.ndarray:
    """(3, 3) rows: left, head and front of this body in the file's axes, by its true landmarks."""
    places = case.landmarks
    up = places["suprasternal_notch"] - places["navel"]
    left = places["nipple_left"] - places["nipple_right"]
    return body_axes(up, np.cross(left, up))


def spread_mm(rows: Sequence[Row]) -> float | None:
    """How far one person's answers lie from their own mean, root mean square over scans and areas; 3D."""
    shown = [row for row in rows if f"{AREA_NAMES[0]}_x" in row]
    if len(shown) < 2:
        return None
    places = np.array([[[row[f"{name}_{axis}"] for axis in "xyz"] for name in AREA_NAMES] for row in shown])
    apart = places - places.mean(axis=0)
    return float(np.sqrt((apart**2).sum(axis=2).sum() / (len(shown) - 1) / len(AREA_NAMES)))


def report(rows: list[Row]) -> Report:
    """Spread by person, and over all."""
    lines: list[tuple[Cell, ...]] = []
    for case in dict.fromkeys(row["case"] for row in rows):
        of_case = [row for row in rows if row["case"] == case]
        shown = sum(row["verdict"] == "show" for row in of_case)
        spreads = [spread_mm([row for row in of_case if row["hand"] == hand]) for hand in HANDS]
        lines.append((case, *spreads, f"{shown} of {len(of_case)}"))
    medians = [_over([line[place] for line in lines], np.median) for place in (1, 2)]
    largest = [_over([line[place] for line in lines], np.max) for place in (1, 2)]
    columns = ("person", *(f"{hand}, mm" for hand in HANDS), "shown without care")
    table = Table(
        "Spread of five scans of one person", columns, [*lines, ("median", *medians, ""), ("largest", *largest, "")]
    )
    return Report((table,), {"median_mm": dict(zip(HANDS, medians, strict=True))})


def _over(values: Sequence[Cell], number: Callable[..., float]) -> float | None:
    known = [value for value in values if isinstance(value, float)]
    return float(number(known)) if known else None


REPEAT = Experiment(
    "repeat",
    "the same person scanned five times: how far apart are the answers?",
    20,
    "how many people",
    _units,
    report,
)
