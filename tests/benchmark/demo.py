"""The three demo scans: enough to see that everything works, too few to prove anything."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from lubdub.results import Patient
from tests.benchmark.measure import Case

DEMO = Path(__file__).parents[2] / "references" / "demo"


def demo_cases() -> list[Case]:
    """The demo scans with their truth, which nothing in the product reads."""
    return [_case(folder) for folder in sorted(DEMO.iterdir()) if folder.is_dir()]


def _case(folder: Path) -> Case:
    patient, clicks, truth = (_read(folder / f"{name}.json") for name in ("patient", "landmarks", "truth"))
    (scan,) = (file for file in folder.iterdir() if file.suffix != ".json")
    return Case(
        name=folder.name,
        group=f"{patient['sex']}, {patient['age_years']:g} years",
        camera=scan.suffix[1:],
        data=scan.read_bytes(),
        patient=Patient(patient["age_years"], patient["sex"], patient["posture"]),
        clicks={name: np.array(place) for name, place in clicks.items()},
        landmarks={name: np.array(place) for name, place in truth["landmarks"].items()},
        areas={name: np.array(place) for name, place in truth["areas"].items()},
        mm_per_unit=truth["mm_per_unit"],
    )


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text())
