"""What runs inside the sandboxed child: the pipeline, from bytes to bytes."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from lubdub import pipeline
from lubdub.cases.screening import unsure_reasons
from lubdub.geometry.sparse import solver_name
from lubdub.jobs.bundle import Bundle
from lubdub.library.load import load_library, state_of
from lubdub.library.nearest import prepare
from lubdub.report.archive import examination_to_bytes, outcome_to_bytes
from lubdub.report.result_json import examination_json, result_json
from lubdub.results import CleanScan, Library, Outcome, Patient, Progress
from lubdub.settings import Settings

NEEDED_LATER = ("scipy.optimize", "trimesh.exchange.ply", "PIL.Image", "pyapriltags")
"""Modules every job imports on its way; a fresh child would spend a second on them. None starts a thread."""


def warm_up() -> None:
    """Load what every job needs, once, before the first child is forked."""
    for module in NEEDED_LATER:
        importlib.import_module(module)
    solver_name()
    prepare(_library_in(Settings().references).references)


def examine_task(payload: bytes, progress: Progress) -> bytes:
    """A scan examined. Parts in: scan; out: examination.npz, examination.json, scan.ply.

    Raises ScanUnreadable and ScanRefused.
    """
    bundle = Bundle.from_bytes(payload)
    facts = bundle.facts
    examination = pipeline.examine(bundle.parts["scan"], _request(facts), _references(facts), progress)
    parts = {
        "examination.npz": examination_to_bytes(examination),
        "examination.json": json.dumps(examination_json(examination)).encode(),
        "scan.ply": surface_ply(examination.scan),
    }
    return Bundle({}, parts).to_bytes()


def locate_task(payload: bytes, progress: Progress) -> bytes:
    """The four areas, or the reason why not. Parts in: scan; out: result.json, outcome.npz.

    Facts out: verdict, and the first reason when refused. Raises ScanUnreadable.
    """
    bundle = Bundle.from_bytes(payload)
    facts = bundle.facts
    outcome = pipeline.locate(bundle.parts["scan"], _request(facts), _references(facts), progress)
    outcome = with_care_when_unsure(outcome, facts["answers"])
    parts = {
        "result.json": json.dumps(result_json(outcome)).encode(),
        "outcome.npz": outcome_to_bytes(outcome),
    }
    is_refused = outcome.verdict == "refuse" and outcome.reasons
    reason = outcome.reasons[0].to_json() if is_refused else None
    return Bundle({"verdict": outcome.verdict, "reason": reason}, parts).to_bytes()


def with_care_when_unsure(outcome: Outcome, answers: Mapping[str, Any]) -> Outcome:
    """The outcome, shown with care when somebody was unsure about a stop question; a refusal stays one."""
    unsure = unsure_reasons(answers)
    if outcome.verdict == "refuse" or not unsure:
        return outcome
    return replace(outcome, verdict="show_with_care", reasons=(*outcome.reasons, *unsure))


def surface_ply(scan: CleanScan) -> bytes:
    """The cleaned skin as binary PLY, in the file's own coordinates and unit, without colour."""
    from trimesh import PointCloud, Trimesh  # heavy, and needed in the child alone
    from trimesh.exchange.ply import export_ply

    vertices = scan.body_from_file.inverse().apply(scan.display.vertices)
    if scan.display.is_cloud:
        return export_ply(PointCloud(vertices))  # type: ignore[no-untyped-call]
    return export_ply(Trimesh(vertices, scan.display.triangles, process=False))


def _request(facts: Mapping[str, Any]) -> pipeline.Request:
    return pipeline.Request(
        patient=Patient(facts["age_years"], facts["sex"], facts["posture"]),
        landmarks={name: np.array(place, np.float64) for name, place in facts["landmarks"].items()},
        unit=facts["unit"],
        method=facts["method"],
    )


def _references(facts: Mapping[str, Any]) -> Library:
    folder = facts["references"]
    return _library_in(None if folder is None else Path(folder))


def _library_in(folder: Path | None) -> Library:
    """The library as it is now: what was loaded before this child was forked serves while nothing has changed."""
    return _library(folder, state_of(folder))


@lru_cache(maxsize=1)
def _library(folder: Path | None, state: object) -> Library:
    return load_library(folder)
