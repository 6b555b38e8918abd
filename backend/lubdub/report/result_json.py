"""The result as JSON: the same from the command line, REST and the page. Positions leave in the file's frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lubdub.geometry.frames import Similarity
from lubdub.geometry.stickers import StickerProof
from lubdub.results import Area, CleanScan, Examination, Landmarks, Outcome, Quality, Unit

DECIMALS_MM = 3
"""Positions are rounded to a thousandth of a millimetre, whatever the file's unit."""


def result_json(outcome: Outcome) -> dict[str, Any]:
    """The result format of the documentation. `areas` is absent when the verdict is refuse."""
    document: dict[str, Any] = {
        "verdict": outcome.verdict,
        "reasons": [reason.to_json() for reason in outcome.reasons],
    }
    if outcome.scan is not None:
        if outcome.areas:
            document["areas"] = {name: _area(area, outcome.scan) for name, area in outcome.areas.items()}
        document["landmarks"] = _landmarks(outcome.landmarks, outcome.scan)
        document["unit"] = _unit(outcome.scan.unit)
        document["stickers"] = _stickers(outcome.stickers)
        document["notes"] = [*outcome.scan.notes, *outcome.notes]
    document["references"] = [
        {"id": one.id, "chamfer_mm": round(one.chamfer_mm, 3), "weight": round(one.weight, 4)}
        for one in outcome.references
    ]
    document["selected"] = outcome.selected
    document["quality"] = _quality(outcome.quality)
    document["steps"] = [{name: round(value, 4) for name, value in step.items()} for step in outcome.steps]
    document["timings_s"] = {stage: round(seconds, 4) for stage, seconds in outcome.timings_s.items()}
    document["method"] = dict(outcome.method)
    return document


def examination_json(examination: Examination) -> dict[str, Any]:
    """What `GET /cases/{id}/scan` says: unit, frame, size, coverage, warnings, suggested landmarks."""
    scan = examination.scan
    return {
        "unit": _unit(scan.unit),
        "stickers": _stickers(examination.stickers),
        "body_from_file": np.round(scan.body_from_file.matrix(), 9).tolist(),
        "size": {name: round(value, 1) for name, value in examination.size.items()},
        "coverage": None if examination.coverage is None else round(examination.coverage, 3),
        "notes": list(scan.notes),
        "warnings": [reason.to_json() for reason in examination.warnings],
        "suggested_landmarks": _landmarks(examination.suggested, scan),
    }


def _area(area: Area, scan: CleanScan) -> dict[str, Any]:
    file_from_body = scan.body_from_file.inverse()
    return {
        "position": position_json(area.position, file_from_body),
        "normal": np.round(file_from_body.turn(area.normal), 6).tolist(),
        "radius_mm": round(area.radius_mm, 1),
        "instruction": area.instruction,
    }


def _landmarks(landmarks: Landmarks, scan: CleanScan) -> Mapping[str, Any]:
    file_from_body = scan.body_from_file.inverse()
    return {
        name: {
            "position": position_json(landmark.position, file_from_body),
            "source": landmark.source,
            "uncertainty_mm": round(landmark.uncertainty_mm, 1),
        }
        for name, landmark in landmarks.items()
    }


def position_json(position: np.ndarray, file_from_body: Similarity) -> list[float]:
    """A place (3,) of the body frame in the file's own coordinates, rounded."""
    digits = DECIMALS_MM + max(0, round(-np.log10(file_from_body.scale)))
    return [round(float(value), digits) for value in file_from_body.apply(position)]


def _unit(unit: Unit) -> dict[str, Any]:
    return {"name": unit.name, "mm_per_unit": unit.mm_per_unit, "source": unit.source}


def _stickers(proof: StickerProof | None) -> dict[str, Any] | None:
    """Null when none were seen. A scan that stickers show to be mirrored is refused, so handedness is `proved` here."""
    return None if proof is None else {"found": list(proof.found), "scale": proof.scale, "handedness": "proved"}


def _quality(quality: Quality | None) -> dict[str, float | None] | None:
    if quality is None:
        return None
    values = {
        "surface_residual_mm": quality.surface_residual_mm,
        "landmark_residual_mm": quality.landmark_residual_mm,
        "coverage": quality.coverage,
        "spread_mm": quality.spread_mm,
    }
    return {name: None if value is None else round(value, 3) for name, value in values.items()}
