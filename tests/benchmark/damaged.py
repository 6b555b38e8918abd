"""`./lubdub benchmark damaged`: is anything far off ever shown without a word of care?

Far off: more than 20 mm beyond the radius that holds 99 in 100 people around the anatomy table's own place, at this
person's true breastbone. What no scan can show (a mirrored one clicked as pictures are) is counted apart.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lubdub.areas.anatomy import places
from lubdub.areas.rule import region_radius_mm
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Library, ScanUnreadable
from tests.benchmark import damage
from tests.benchmark.damage import Draft, Staging
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import Run, errors_of, run_on, shipped_library

BEYOND_MM = 20.0
PLAINLY_FAR_MM = 30.0
FIVE = Run("lubdub", "five")


@dataclass(frozen=True)
class Damage:
    """One thing that goes wrong. visible: whether scan and clicks together can show it."""

    name: str
    make: Callable[[Staging], Draft]
    visible: bool = True
    times: int = 1
    """How often as many cases as of the others."""


GOOD = Damage("good scan", damage.good, times=4)
DAMAGES: tuple[Damage, ...] = (
    GOOD,
    Damage("mirrored, clicked by the body", damage.mirrored_by_body),
    Damage("mirrored, clicked by the picture", damage.mirrored_by_picture, visible=False),
    Damage("right half missing", damage.half_missing(0, 1.0)),
    Damage("left half missing", damage.half_missing(0, -1.0)),
    Damage("lower half missing", damage.half_missing(1, 1.0)),
    Damage("upper half missing", damage.half_missing(1, -1.0)),
    Damage("T-shirt", damage.dressed("T-shirt")),
    Damage("band over the breasts", damage.dressed("band")),
    Damage("cloth over a part", damage.dressed("cloth")),
    Damage("legs", damage.elsewhere("legs")),
    Damage("head", damage.elsewhere("head")),
    Damage("back side, clicked by the body", damage.back_side(by_body=True)),
    Damage("back side, clicked as a front", damage.back_side(by_body=False)),
    Damage("centimetres called metres", damage.centimetres_called_metres),
    Damage("inches, not said", damage.inches_not_said),
    Damage("inches called centimetres", damage.inches_called_centimetres),
    Damage("10 % too large", damage.scaled(1.1)),
    Damage("10 % too small", damage.scaled(0.9)),
    Damage("nipples swapped", damage.nipples_swapped),
    Damage("notch and navel swapped", damage.notch_and_navel_swapped),
    *(Damage(f"wild click: {name}", damage.one_wild(name)) for name in LANDMARK_NAMES),
    Damage("hollow clicked", damage.hollow_clicked),
    Damage("two people", damage.two_people),
    Damage("clicks on two people", damage.clicks_on_two_people),
    Damage("motion blur", damage.motion_blur),
    Damage("breastbone sunk in by 25 mm", damage.sunken(25.0)),
    Damage("right half missing, no bone marked", damage.boneless(damage.half_missing(0, 1.0))),
    Damage("left half missing, no bone marked", damage.boneless(damage.half_missing(0, -1.0))),
)


def _units(size: int, seed: int) -> Iterable[Unit]:
    """Every damage meets other people: the groups and scanners go round."""
    number = 0
    for round_ in range(size):
        for kind, one in enumerate(DAMAGES):
            for again in range(one.times):
                key = f"{one.name} {round_} {again}"
                yield Unit(key, functools.partial(_work, seed, number, kind))
                number += 1


def _work(seed: int, number: int, kind: int) -> list[Row]:
    staging = Staging.of(seed, number, kind)
    return [measured(staging, DAMAGES[kind], shipped_library())]


def measured(staging: Staging, one: Damage, library: Library) -> Row:
    """Make the damaged scan, run on it, and say how far beyond its limit each area was shown."""
    case = one.make(staging).case(staging, one.name)
    try:
        row = run_on(case, FIVE, library)
    except ScanUnreadable:
        row = {"case": case.name, "group": case.group, "camera": case.camera, "run": FIVE.name, "verdict": "refuse"}
        row["reasons"] = "unreadable"
    limits = limits_mm(staging.subject.phenotype.age_years, staging.subject.sternum_mm)
    over = [row[f"{name}_mm"] - limits[name] for name in AREA_NAMES if f"{name}_mm" in row]
    return {"damage": one.name, **row, "beyond_limit_mm": round(max(over), 3) if over else None}


def limits_mm(age_years: float, sternum_mm: float) -> Mapping[str, float]:
    """From where on an area is far off: what people differ by, and 20 mm."""
    return {
        name: BEYOND_MM + region_radius_mm(sternum_mm * np.array([place.spread_left, place.spread_below]), held=0.99)
        for name, place in places(age_years).items()
    }


COLUMNS = (
    *("damage", "cases", "shown", "with care", "refused", "worst shown_mm", "far off, shown", "> 30 mm, shown"),
    *("far off, with care", "reasons named"),
)


def line(name: str, rows: Sequence[Row]) -> tuple[Cell, ...]:
    """One line of the table, for one damage."""
    shown = [row for row in rows if row["verdict"] == "show"]
    care = [row for row in rows if row["verdict"] == "show_with_care"]
    count = len(rows)
    worst = float(errors_of(shown).max()) if shown else None
    shares = (len(shown) / count, len(care) / count, (count - len(shown) - len(care)) / count)
    far = sum(errors_of([row]).max() > PLAINLY_FAR_MM for row in shown)
    return (name, count, *shares, worst, far_off(shown), int(far), far_off(care), _reasons(rows))


def far_off(rows: Sequence[Row]) -> int:
    """How many show an area beyond its limit."""
    return sum(row["beyond_limit_mm"] is not None and row["beyond_limit_mm"] > 0 for row in rows)


def _reasons(rows: Sequence[Row]) -> str:
    named = Counter(code for row in rows for code in row["reasons"].split())
    return ", ".join(f"{code} {count}" for code, count in named.most_common(4))


def report(rows: list[Row]) -> Report:
    """`silent_far_off` must be 0 and `good_shown_share` at least 0.97."""
    names = {one.name: one.visible for one in DAMAGES}
    lines = {name: line(name, found) for name in names if (found := [row for row in rows if row["damage"] == name])}
    seen = [row for row in rows if names[row["damage"]] and row["damage"] != GOOD.name]
    everything = line("all damages that can be seen", seen) if seen else ()
    tables = (
        Table("Damaged scans, five clicks", COLUMNS, [*(lines[name] for name in lines if names[name]), everything]),
        Table("Damage that no scan can show", COLUMNS, [lines[name] for name in lines if not names[name]]),
        Table("Far off and shown without care", _WORST, [_worst(row) for row in _silent(rows)]),
    )
    good = [row for row in rows if row["damage"] == GOOD.name]
    numbers: dict[str, Any] = {
        "silent_far_off": far_off([row for row in (*seen, *good) if row["verdict"] == "show"]),
        "good_shown_share": sum(row["verdict"] == "show" for row in good) / max(len(good), 1),
    }
    return Report(tables, numbers)


_WORST = ("case", "camera", "worst error_mm", "beyond its limit_mm")


def _silent(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["verdict"] == "show" and far_off([row])]


def _worst(row: Row) -> tuple[Cell, ...]:
    return (row["case"], row["camera"], float(errors_of([row]).max()), row["beyond_limit_mm"])


DAMAGED = Experiment(
    "damaged",
    "scans and clicks that are wrong: is it said?",
    2,
    f"how many rounds of {sum(one.times for one in DAMAGES)} scans",
    _units,
    report,
)
