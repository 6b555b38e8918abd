"""Running a method on a scan whose truth is known, and adding up how far off it was."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from lubdub.fitting.shape import carried
from lubdub.library.load import load_library
from lubdub.pipeline import Request, locate
from lubdub.report.result_json import result_json
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, LandmarkName, Library, MethodName, Outcome, Patient
from tests.benchmark.experiment import Cell, Row, Table

Points = Mapping[str, np.ndarray]

shipped_library: Callable[[], Library] = functools.cache(load_library)
"""The shipped references, read once for all units of an experiment."""


@dataclass(frozen=True)
class Case:
    """A scan with its truth; every point (3,) in the file's coordinates.

    clicks: where somebody marked the landmarks; landmarks, areas: the truth under the skin. mesh_clicks and
    mesh_areas: the same for a body whose bones follow its skin, which is all a registration alone can know.
    """

    name: str
    group: str
    data: bytes
    patient: Patient
    clicks: Mapping[LandmarkName, np.ndarray]
    landmarks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    mm_per_unit: float
    mesh_clicks: Points = field(default_factory=dict)
    mesh_areas: Points = field(default_factory=dict)
    camera: str = ""
    unit: str | None = None


@dataclass(frozen=True)
class Run:
    """One way of asking: which method, with which of the landmarks. carried: judge the mesh's own areas."""

    method: MethodName
    landmarks: str
    carried: bool = False

    @property
    def name(self) -> str:
        """As the tables call it."""
        return f"{self.method}, {'mesh alone' if self.carried else self.landmarks}"

    def clicks(self, case: Case) -> dict[LandmarkName, np.ndarray]:
        """The landmarks handed to the method."""
        if self.landmarks == "true bones":
            return {name: case.landmarks[name] for name in LANDMARK_NAMES[:2]}
        source = case.mesh_clicks if self.carried else case.clicks
        return {name: source[name] for name in LANDMARK_SETS[self.landmarks] if name in source}


LANDMARK_SETS: Mapping[str, tuple[LandmarkName, ...]] = {
    "five": LANDMARK_NAMES,
    "paper's three": ("navel", "nipple_left", "nipple_right"),
    "none": (),
}


def run_on(case: Case, run: Run, library: Library) -> Row:
    """One method on one scan. Errors are 3D distances in mm from the shown place to the true one."""
    begun = time.perf_counter()
    outcome = locate(case.data, Request(case.patient, run.clicks(case), case.unit, run.method), library)
    seconds = time.perf_counter() - begun
    row: Row = {"case": case.name, "group": case.group, "camera": case.camera, "run": run.name}
    row["verdict"] = outcome.verdict
    row |= {"reasons": " ".join(reason.code for reason in outcome.reasons), "seconds": round(seconds, 4)}
    found = result_json(outcome)
    mesh_areas = _mesh_areas(outcome, library) if run.carried else {}
    for name, area in found.get("areas", {}).items():
        place, truth = np.array(area["position"]), case.areas[name]
        if run.carried:
            place, truth = mesh_areas[name], case.mesh_areas[name]
        row[f"{name}_mm"] = round(float(np.linalg.norm(place - truth)) * case.mm_per_unit, 3)
        row[f"{name}_radius_mm"] = area["radius_mm"]
    for name, mark in found.get("landmarks", {}).items():
        if mark["source"] == "suggested":
            gap = float(np.linalg.norm(np.array(mark["position"]) - case.landmarks[name])) * case.mm_per_unit
            row[f"{name}_off_mm"] = round(gap, 3)
    return row


def _mesh_areas(outcome: Outcome, library: Library) -> dict[AreaName, np.ndarray]:
    """Where the registered body itself carries the average body's areas, in the file; empty when refused."""
    if outcome.fit is None or outcome.scan is None:
        return {}
    to_file = outcome.scan.body_from_file.inverse()
    return {name: to_file.apply(place) for name, place in carried(outcome.fit.surface, library.basis).areas.items()}


def errors_of(rows: Sequence[Row]) -> np.ndarray:
    """All errors of all areas, mm."""
    return np.array([row[f"{name}_mm"] for row in rows for name in AREA_NAMES if f"{name}_mm" in row])


def radii_of(rows: Sequence[Row]) -> np.ndarray:
    """The radii that belong to `errors_of`, mm."""
    return np.array([row[f"{name}_radius_mm"] for row in rows for name in AREA_NAMES if f"{name}_mm" in row])


def summary(rows: Sequence[Row]) -> dict[str, Cell]:
    """Errors over all areas of all runs that were not refused; nothing clipped, nothing dropped."""
    errors, shown = errors_of(rows), [row for row in rows if row["verdict"] == "show"]

    def of(values: np.ndarray, number: Callable[[np.ndarray], float]) -> float | None:
        return float(number(values)) if len(values) else None

    return {
        "runs": len(rows),
        "mean_mm": of(errors, np.mean),
        "median_mm": of(errors, np.median),
        "p95_mm": of(errors, lambda values: np.percentile(values, 95)),
        "max_mm": of(errors, np.max),
        "max_shown_mm": of(errors_of(shown), np.max),
        **{f"{name}_mm": of(area_errors(rows, name), np.mean) for name in AREA_NAMES},
        "held_share": of(errors <= radii_of(rows), np.mean),
        "radius_mm": of(radii_of(rows), np.median),
        "shown_share": of(np.array([row["verdict"] == "show" for row in rows]), np.mean),
        "refused_share": of(np.array([row["verdict"] == "refuse" for row in rows]), np.mean),
        "median_s": of(np.array([row["seconds"] for row in rows]), np.median),
    }


def area_errors(rows: Sequence[Row], name: AreaName) -> np.ndarray:
    """Errors of one area, mm."""
    return np.array([row[f"{name}_mm"] for row in rows if f"{name}_mm" in row])


COLUMNS = (
    *("mean_mm", "median_mm", "p95_mm", "max_mm", "max_shown_mm", "mitral_mm"),
    *("held_share", "radius_mm", "shown_share", "refused_share", "median_s"),
)


def runs_table(title: str, rows: Sequence[Row]) -> Table:
    """One line for each run."""
    lines = []
    for name in dict.fromkeys(row["run"] for row in rows):
        numbers = summary([row for row in rows if row["run"] == name])
        lines.append((name, *(numbers[column] for column in COLUMNS)))
    return Table(title, ("run", *COLUMNS), lines)


def groups_table(title: str, rows: Sequence[Row], column: str, by: str = "group") -> Table:
    """One line for each group of people or each `by`, one column for each run; cells: `column` of the summary."""
    runs = list(dict.fromkeys(row["run"] for row in rows))
    lines: list[tuple[Cell, ...]] = []
    for group in dict.fromkeys(row[by] for row in rows):
        of_group = [row for row in rows if row[by] == group]
        cells = [summary([row for row in of_group if row["run"] == run])[column] for run in runs]
        lines.append((group, *cells))
    return Table(title, (by, *runs), lines)
