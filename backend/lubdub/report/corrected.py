"""A result with some of its areas where a clinician put them. The computed result itself stays as it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lubdub.geometry.skin_walk import SkinWalker
from lubdub.report.result_json import position_json
from lubdub.results import AreaName, CleanScan, Outcome


def walker_on(scan: CleanScan) -> SkinWalker:
    """Walks on the skin as it is shown."""
    return SkinWalker(scan.display, scan.points, scan.normals)


def corrected(outcome: Outcome, places: Mapping[AreaName, Sequence[float]]) -> Outcome:
    """The outcome with these areas moved. places: name -> [x, y, z] in the file's own coordinates, on the skin."""
    if outcome.scan is None or not places:
        return outcome
    walker = walker_on(outcome.scan)
    moved = {}
    for name, in_file in places.items():
        place = outcome.scan.body_from_file.apply(np.asarray(in_file, float))
        moved[name] = replace(outcome.areas[name], position=place, normal=walker.normal(place))
    return replace(outcome, areas={**outcome.areas, **moved})


def corrected_json(outcome: Outcome, moved: Outcome, name: AreaName) -> dict[str, Any]:
    """One corrected area, in the file's coordinates, and how far it lies from the computed one, in mm."""
    if outcome.scan is None:
        raise ValueError("there is no scan")
    file_from_body = outcome.scan.body_from_file.inverse()
    area = moved.areas[name]
    return {
        "position": position_json(area.position, file_from_body),
        "normal": np.round(file_from_body.turn(area.normal), 6).tolist(),
        "moved_mm": round(float(np.linalg.norm(area.position - outcome.areas[name].position)), 1),
    }
