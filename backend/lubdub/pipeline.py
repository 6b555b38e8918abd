"""The whole journey on one screen: read -> clean -> landmarks -> fit -> choose -> project -> judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lubdub import assembly, stages
from lubdub.judging.verdict import judge
from lubdub.methods import METHODS
from lubdub.results import (
    Examination,
    LandmarkName,
    Library,
    MethodName,
    Outcome,
    Patient,
    Progress,
    ScanRefused,
)
from lubdub.scans.check import check_scan
from lubdub.scans.read import read_scan
from lubdub.stickers import Prepared, check_order, prepare


@dataclass(frozen=True)
class Request:
    """What was asked. landmarks: name -> (3,) in the file's own coordinates and unit; unit: m, cm, mm or None."""

    patient: Patient = field(default_factory=Patient)
    landmarks: Mapping[LandmarkName, np.ndarray] = field(default_factory=dict)
    unit: str | None = None
    method: MethodName = "lubdub"


def quiet(stage: str, fraction: float) -> None:
    """A progress listener that does not listen."""


def examine(data: bytes, request: Request, library: Library, progress: Progress = quiet) -> Examination:
    """Read and clean a scan and suggest its landmarks, before any run.

    Where the shape does not say how the body lies there is no suggestion, and the warning `lie_unclear` says so.
    Raises ScanUnreadable when the bytes are no body scan, ScanRefused when nothing may be shown of it.
    """
    clock = assembly.Clock(progress)
    with clock("read"):
        raw = read_scan(data)
    with clock("clean"):
        ready = check_order(prepare(raw, request.unit, request.landmarks), library.basis)
    try:
        with clock("clean"):
            laid = _laid(ready, request, library)
        with clock("fit"):
            chest = stages.understand(laid, request.patient, "lubdub", library)
        examination = assembly.examined(chest, library.basis.data_weight)
    except stages.LieUnclear as unclear:
        examination = assembly.examined_unturned(ready, unclear.guess)
    return replace(examination, warnings=(*ready.warnings, *examination.warnings), stickers=ready.proof)


def locate(data: bytes, request: Request, library: Library, progress: Progress = quiet) -> Outcome:
    """The four areas on this body, judged. A refusal is an Outcome too; only ScanUnreadable is raised."""
    clock = assembly.Clock(progress)
    provenance = assembly.provenance(request.method, library)
    ready: Prepared | None = None
    try:
        with clock("read"):
            raw = read_scan(data)
        with clock("clean"):
            ready = prepare(raw, request.unit, request.landmarks)
            ready = check_order(ready, library.basis)
            laid = _laid(ready, request, library)
            warnings = (*ready.warnings, *check_scan(laid.scan), *stages.check(laid, request.patient))
        with clock("fit"):
            chest = stages.understand(laid, request.patient, request.method, library)
            chest = stages.with_overlay(chest, request.method, library)
        with clock("choose"):
            located = METHODS[request.method](chest, library, progress)
        with clock("project"):
            areas, gaps = stages.project(chest, located, raw)
        with clock("judge"):
            evidence = stages.evidence(chest, located, gaps, areas, request.method)
            judged = judge(evidence, warnings)
    except ScanRefused as refusal:
        return assembly.refused(refusal.reason, ready, provenance, clock)
    outcome = assembly.outcome(chest, located, areas, evidence, judged, provenance, clock)
    return replace(outcome, stickers=ready.proof)


def _laid(ready: Prepared, request: Request, library: Library) -> stages.Laid:
    return stages.lay_down(ready.scan, ready.marked, library.basis, request.patient, ready.by_sticker, ready.tint)
