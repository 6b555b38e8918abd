"""Bodies like the paper's: a standard man with eight others, and eight men scanned on a bed; its method on them."""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from lubdub import stages
from lubdub.fitting.paper import fit_paper
from lubdub.fitting.schedule import FAITHFUL
from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.library.similar import ScanView, SimilaritySettings, overlay
from lubdub.results import (
    AREA_NAMES,
    LANDMARK_NAMES,
    CleanScan,
    Landmark,
    LandmarkName,
    Library,
    Patient,
    Reference,
    ScanRefused,
)
from lubdub.scans.clean import clean
from lubdub.scans.read import read_scan
from lubdub.scans.units import find_unit
from references.make.anatomy import drop_on_skin
from references.make.cameras import SCANNERS
from references.make.moment import Moment
from references.make.phenotype import Phenotype
from references.make.posture import draw_lying
from references.make.scan import smooth_skin
from references.make.subject import draw_subject
from tests.benchmark import cohort
from tests.benchmark.experiment import Row
from tests.benchmark.measure import Case, Run, run_on, shipped_library

FACTS: Mapping[str, Any] = json.loads((Path(__file__).parent / "paper_facts.json").read_text())

BODIES: tuple[tuple[str, float, float], ...] = (
    ("standard", 1.0, 0.5),
    ("light", 1.0, 0.1),
    ("heavy", 1.0, 1.1),
    ("small", 0.92, 0.5),
    ("tall", 1.08, 0.5),
    ("small and light", 0.92, 0.1),
    ("small and heavy", 0.92, 1.1),
    ("tall and light", 1.08, 0.1),
    ("tall and heavy", 1.08, 1.1),
)
"""Name, stature against the standard, MakeHuman's weight. The paper shows nine types, "including light, heavy, small,
and tall"; which number is which it does not say."""

STATURE_MM = 1730.0
"""The mean of the paper's volunteers."""
MARK_MM = 5.0
"""How far off nipples and navel are marked by hand, on scans and on references alike."""
THREE: tuple[LandmarkName, ...] = ("navel", "nipple_left", "nipple_right")
ON_SKIN = " on the skin"
"""Ends the name of an area where the skin would carry it if bones under it did not differ between people."""
OURS = (Run("lubdub", "five"), Run("rule", "five"), Run("paper", "paper's three"))
"""The last: the paper's method choosing among the shipped references."""


@dataclass(frozen=True)
class Man:
    """One of the men: a scan of him with its truth, and himself as a reference for the others."""

    case: Case
    reference: Reference


@functools.cache
def software_bodies() -> tuple[Man, ...]:
    """The standard body and eight others: whole clean meshes, areas by the anatomy table, clicks as off as ever."""
    return tuple(_software_body(number, *recipe) for number, recipe in enumerate(BODIES))


def _software_body(number: int, name: str, tall: float, weight: float) -> Man:
    workshop = cohort.workshop()
    phenotype = Phenotype(30.0, "male", STATURE_MM * tall, weight=weight, height=0.5 + 1.5 * (tall - 1.0))
    body = workshop.body(phenotype)
    skin = smooth_skin(Surface(body.vertices, workshop.torso.triangles))
    landmarks: dict[Any, np.ndarray] = dict(zip(LANDMARK_NAMES, body.landmarks.positions, strict=True))
    areas: dict[Any, np.ndarray] = dict(zip(AREA_NAMES, body.areas.positions, strict=True))
    noise = cohort.CLICK_MM[:, None] / np.sqrt(2.0) * np.random.default_rng(number).normal(size=(5, 2))
    clicked = drop_on_skin(body.landmarks.positions[:, :2] + noise, skin.vertices, skin.triangles).positions
    mesh = trimesh.Trimesh(skin.vertices.astype(np.float32), skin.triangles, process=False)
    case = Case(
        name=name,
        group="software bodies",
        data=bytes(mesh.export(file_type="ply")),
        patient=Patient(30.0, "male"),
        clicks=dict(zip(LANDMARK_NAMES, clicked, strict=True)),
        landmarks=landmarks,
        areas=areas,
        mm_per_unit=1.0,
    )
    return Man(case, Reference(name, skin, landmarks, areas, {}))


@functools.cache
def volunteers(seed: int, group: int) -> tuple[Man, ...]:
    """Eight men with the paper's statures and body mass indices, bones drawn under the skin, one depth frame each."""
    pairs = FACTS["volunteers"]
    return tuple(_volunteer(seed, group, number, *pair) for number, pair in enumerate(pairs, start=1))


def _volunteer(seed: int, group: int, number: int, height_m: float, body_mass_index: float) -> Man:
    random = np.random.default_rng([seed, group, number])
    phenotype = Phenotype(
        age_years=float(random.uniform(22.0, 45.0)),
        sex="male",
        stature_mm=1000.0 * height_m,
        muscle=float(random.uniform(0.3, 0.7)),
        weight=float(np.clip(0.5 + (body_mass_index - 22.5) / 12.0, 0.05, 1.25)),
        proportions=float(random.uniform(0.2, 0.8)),
        arms_deg=(float(random.uniform(26, 38)), float(random.uniform(26, 38))),
    )
    workshop = cohort.workshop()
    subject = draw_subject(workshop, random, phenotype, lying=draw_lying(random))
    scene, places = cohort.lay(subject, random, Moment())
    camera = "overhead depth frame"
    person = cohort.Person(f"#{number}", "volunteers")
    case = cohort.case_of(person, camera, subject, SCANNERS[camera](scene, random), places)
    skin = Surface(subject.whole[workshop.torso.indices], workshop.torso.triangles)
    marks = subject.landmarks + MARK_MM / np.sqrt(2.0) * random.normal(size=(5, 3)) * [1.0, 1.0, 0.0]
    landmarks: dict[Any, np.ndarray] = dict(zip(LANDMARK_NAMES, marks, strict=True))
    areas: dict[Any, np.ndarray] = dict(zip(AREA_NAMES, subject.areas, strict=True))
    areas |= {f"{name}{ON_SKIN}": place for name, place in zip(AREA_NAMES, subject.mesh_areas, strict=True)}
    return Man(case, Reference(person.name, skin, landmarks, areas, {}))


def registered(case: Case, references: Mapping[str, Reference]) -> list[Row]:
    """The paper's method from each reference onto one scan, 25,000 points on both sides: a row each."""
    scan, to_file, marks = _prepared(case)
    settings = SimilaritySettings()
    view = ScanView.of(scan, settings)
    rows = []
    for name, reference in references.items():
        found = overlay(view, marks, reference, settings)
        begun = time.perf_counter()
        try:
            fit = fit_paper(scan, marks, reference, found.start, FAITHFUL)
        except ScanRefused:
            continue
        seconds = time.perf_counter() - begun
        row: Row = {"scan": case.name, "reference": name, "chamfer_mm": found.chamfer_mm, "start": found.route}
        for area in AREA_NAMES:
            row[f"{area}_mm"] = _gap(to_file.apply(fit.areas[area]), case.areas[area], case)
        row |= {"mean_mm": _mean(row), "seconds": round(seconds, 3)}
        if case.mesh_areas:
            carried: Mapping[str, np.ndarray] = fit.areas
            gaps = [_gap(to_file.apply(carried[f"{a}{ON_SKIN}"]), case.mesh_areas[a], case) for a in AREA_NAMES]
            row["skin_mm"] = round(float(np.mean(gaps)), 3)
        rows.append(row)
    return rows


def _gap(place: np.ndarray, truth: np.ndarray, case: Case) -> float:
    return round(float(np.linalg.norm(place - truth)) * case.mm_per_unit, 3)


def _prepared(case: Case) -> tuple[CleanScan, Similarity, dict[LandmarkName, Landmark]]:
    """The cleaned scan in the body frame, body -> file, and the paper's three landmarks."""
    clicks = {name: case.clicks[name] for name in THREE}
    raw = read_scan(case.data)
    scan = clean(raw, find_unit(raw, None, clicks), clicks)
    laid = stages.lay_down(scan, clicks, shipped_library().basis, Patient())
    marks = {name: Landmark(place, "given", MARK_MM) for name, place in laid.given.items()}
    return laid.scan, laid.scan.body_from_file.inverse(), marks


def by_ours(case: Case, library: Library) -> list[Row]:
    """Our two methods with five landmarks, and the paper's choosing among the shipped bodies, on the same scan."""
    rows = []
    for run in OURS:
        row = run_on(case, run, library)
        rows.append({"scan": case.name, **row, "mean_mm": _mean(row) if "mitral_mm" in row else None})
    return rows


def work_software(number: int) -> list[Row]:
    """A row of the paper's Table 1, and our methods on the same body."""
    standard, man = software_bodies()[0], software_bodies()[number]
    rows = registered(man.case, {"standard": standard.reference}) + by_ours(man.case, shipped_library())
    return [{"table": "bodies", "number": number, **row} for row in rows]


def work_volunteer(seed: int, group: int, number: int) -> list[Row]:
    """The seven rows of the paper's Table 3 that belong to one man, and our methods on his scan."""
    men = volunteers(seed, group)
    case = men[number - 1].case
    others = {man.case.name: man.reference for man in men if man.case.name != case.name}
    rows = registered(case, others) + by_ours(case, shipped_library())
    return [{"table": "pairs", "group_of_eight": group, "number": number, **row} for row in rows]


def _mean(row: Row) -> float:
    return round(float(np.mean([row[f"{area}_mm"] for area in AREA_NAMES])), 3)
