"""A child's chest made by formula, examined and located by hand: no file, no pipeline."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.frames import Similarity
from lubdub.results import (
    Area,
    CleanScan,
    Examination,
    Landmark,
    LandmarkName,
    Outcome,
    Quality,
    RankedReference,
    Unit,
)
from tests import bodies

BODY = bodies.hide_side(bodies.torso_scan(size=0.6, columns=140, rows=120))
METRES = Similarity(1000.0, np.eye(3), np.zeros(3))


def clean_scan() -> CleanScan:
    """As the scans room would hand it over; the file is in metres."""
    skin = BODY.surface
    return CleanScan(
        points=skin.vertices,
        normals=skin.normals,
        is_border=np.zeros(len(skin.vertices), bool),
        drape=lambda: skin,
        body_from_file=METRES,
        unit=Unit("m", 1000.0, "found"),
    )


def landmarks(source: str = "given") -> dict[LandmarkName, Landmark]:
    """All five, on the skin."""
    return {name: Landmark(place, source, 5.0) for name, place in BODY.landmarks.items()}  # type: ignore[arg-type]


def examination() -> Examination:
    """Before anybody has placed a point."""
    return Examination(
        scan=clean_scan(),
        size={"width_mm": 236.0, "length_mm": 300.0, "depth_mm": 140.0, "chest_width_mm": 236.0},
        coverage=0.95,
        suggested=landmarks("suggested"),
        warnings=(),
    )


def outcome() -> Outcome:
    """A finished, good result."""
    scan = clean_scan()
    _, nearest = cKDTree(scan.display.vertices).query(list(BODY.areas.values()))
    areas = {}
    for (name, place), vertex in zip(BODY.areas.items(), nearest, strict=True):
        areas[name] = Area(
            place, scan.display.normals[vertex], 9.0 if name != "mitral" else 14.0, f"Where {name} is heard."
        )
    return Outcome(
        verdict="show",
        reasons=(),
        areas=areas,
        landmarks=landmarks(),
        scan=scan,
        fit=None,
        references=(RankedReference("sample", 3.1, 1.0),),
        selected="sample",
        quality=Quality(1.4, 2.0, 0.95, 4.0),
        timings_s={"total": 1.0},
        method={"version": "0.1.0", "solver": "superlu"},
    )
