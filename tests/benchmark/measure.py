"""Running the three methods on scans whose truth is known, and adding up how far off they were."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lubdub.pipeline import Request, locate
from lubdub.report.result_json import result_json
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, LandmarkName, Library, MethodName, Patient

LANDMARK_SETS: Mapping[str, tuple[LandmarkName, ...]] = {
    "five": LANDMARK_NAMES,
    "paper's three": ("navel", "nipple_left", "nipple_right"),
    "none": (),
}


@dataclass(frozen=True)
class Case:
    """A scan with its truth. clicks, areas: name -> (3,) in the file's coordinates."""

    name: str
    group: str
    data: bytes
    patient: Patient
    clicks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    mm_per_unit: float


@dataclass(frozen=True)
class Row:
    """One run. errors_mm, held: by area, empty when refused; held says whether the region held the truth."""

    case: str
    group: str
    method: MethodName
    landmarks: str
    verdict: str
    reasons: tuple[str, ...]
    errors_mm: Mapping[str, float]
    held: Mapping[str, bool]
    seconds: float


def run(case: Case, method: MethodName, landmarks: str, library: Library) -> Row:
    """One method on one scan with one set of landmarks."""
    clicks = {name: case.clicks[name] for name in LANDMARK_SETS[landmarks]}
    begun = time.perf_counter()
    outcome = locate(case.data, Request(case.patient, clicks, method=method), library)
    seconds = time.perf_counter() - begun
    found = result_json(outcome).get("areas", {})
    errors = {
        name: float(np.linalg.norm(np.array(area["position"]) - case.areas[name])) * case.mm_per_unit
        for name, area in found.items()
    }
    held = {name: errors[name] <= found[name]["radius_mm"] for name in errors}
    reasons = tuple(reason.code for reason in outcome.reasons)
    return Row(case.name, case.group, method, landmarks, outcome.verdict, reasons, errors, held, seconds)


def run_all(cases: Iterable[Case], runs: Sequence[tuple[MethodName, str]], library: Library) -> list[Row]:
    """Every run on every case, in order."""
    return [run(case, method, landmarks, library) for case in cases for method, landmarks in runs]


def summary(rows: Sequence[Row]) -> dict[str, float | None]:
    """Errors over all areas of all runs that were not refused; nothing clipped, nothing dropped."""
    errors = np.array([error for row in rows for error in row.errors_mm.values()])
    shown = [row for row in rows if row.verdict == "show"]
    held = [inside for row in rows for inside in row.held.values()]
    by_area = {
        f"{name}_mm": float(np.mean([row.errors_mm[name] for row in rows if row.errors_mm])) if len(errors) else None
        for name in AREA_NAMES
    }
    return {
        "runs": len(rows),
        "mean_mm": float(errors.mean()) if len(errors) else None,
        "median_mm": float(np.median(errors)) if len(errors) else None,
        "p95_mm": float(np.percentile(errors, 95)) if len(errors) else None,
        "max_mm": float(errors.max()) if len(errors) else None,
        "max_shown_mm": max((max(row.errors_mm.values()) for row in shown), default=None),
        **by_area,
        "held_share": float(np.mean(held)) if held else None,
        "shown_share": len(shown) / len(rows),
        "refused_share": sum(row.verdict == "refuse" for row in rows) / len(rows),
        "median_s": float(np.median([row.seconds for row in rows])),
    }
