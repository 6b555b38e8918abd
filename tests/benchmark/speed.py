"""`./lubdub benchmark speed`: seconds and memory of the whole product, each run in a fresh process.

A process loads the references and runs once unmeasured, as the warm process of the service does; then it is timed,
from the file's bytes to the verdict. Its memory is the most it ever held, libraries and all. The inputs are made from
the demo scans, so that everybody times the same ones. Methods take turns, so that a busy
minute hits all of them; cpu_s is the work done, whatever else the machine did.
"""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmark.demo import demo_cases
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import Case
from tests.benchmark.stopwatch import FAITHFUL_NAME

PROJECT = Path(__file__).parents[2]
NOISE_MM = 1.0
"""Between copies of a point when a scan is given more points than its camera saw."""
SKIN_REACH_MM = 8.0

METHODS = ("lubdub", "rule", "paper", FAITHFUL_NAME)
LIMITS_S: Mapping[str, float] = {"cleaned, 25,000 points": 0.6, "300,000 points": 2.0, "1.2 million triangles": 5.0}
LIMIT_MB = 1024.0


def cleaned_case() -> Case:
    """25,000 points of one person's front, no bed."""
    from scipy.spatial import cKDTree

    from lubdub.scans.clean import clean
    from lubdub.scans.read import read_scan
    from lubdub.scans.units import find_unit

    case = crowded_case()
    raw = read_scan(case.data)
    scan = clean(raw, find_unit(raw, None, case.clicks), case.clicks)
    skin = scan.body_from_file.inverse().apply(scan.points)
    points = raw.surface.vertices
    on_skin = points[cKDTree(skin).query(points)[0] * case.mm_per_unit < SKIN_REACH_MM]
    chosen = np.random.default_rng(1).choice(len(on_skin), 25_000, replace=False)
    return _as_points(case, on_skin[np.sort(chosen)])


def crowded_case(count: int = 300_000) -> Case:
    """The person on the bed under a depth camera, as if it had seen so many points."""
    from lubdub.scans.read import read_scan

    case = _demo("overhead-bed")
    points = read_scan(case.data).surface.vertices
    random = np.random.default_rng(1)
    copies = points[np.arange(count) % len(points)]
    copies = copies + random.normal(0.0, NOISE_MM / case.mm_per_unit, copies.shape)
    return _as_points(case, copies)


def fine_case(count: int = 1_200_000) -> Case:
    """The mesh of a hand-held scanner, its triangles quartered until there are about so many."""
    import trimesh

    from lubdub.scans.read import read_scan

    case = _demo("scanner-woman")
    surface = read_scan(case.data).surface
    vertices, triangles = surface.vertices, surface.triangles
    while len(triangles) < count:
        quartered = np.arange(min(len(triangles), -(-(count - len(triangles)) // 3)))
        vertices, triangles = trimesh.remesh.subdivide(vertices, triangles, quartered)
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    return replace(case, data=bytes(mesh.export(file_type="ply")))


def _demo(name: str) -> Case:
    (case,) = (case for case in demo_cases() if case.name == name)
    return case


def _as_points(case: Case, points: np.ndarray) -> Case:
    import trimesh

    return replace(case, data=bytes(trimesh.PointCloud(points).export(file_type="ply")))


INPUTS: Mapping[str, Callable[[], Case]] = dict(zip(LIMITS_S, (cleaned_case, crowded_case, fine_case), strict=True))


@functools.cache
def _input_folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="lubdub-speed-")


@functools.cache
def _files(name: str) -> tuple[Path, Path]:
    """The scan of an input, and what is said about it."""
    case = INPUTS[name]()
    stem = Path(_input_folder().name) / str(list(INPUTS).index(name))
    scan, words = stem.with_suffix(".scan"), stem.with_suffix(".json")
    scan.write_bytes(case.data)
    clicks = {name: list(place) for name, place in case.clicks.items()}
    words.write_text(json.dumps({"clicks": clicks, "age": case.patient.age_years, "sex": case.patient.sex}))
    return scan, words


def timed(name: str, method: str) -> list[Row]:
    """One method on one input in a process of its own."""
    scan, words = _files(name)
    paths = [str(PROJECT / "backend"), str(PROJECT)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "-m", "tests.benchmark.stopwatch", str(scan), str(words), method]
    done = subprocess.run(command, env=environment, cwd=PROJECT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the timed process failed: {done.stderr.strip()[-500:]}")
    found: dict[str, Any] = json.loads(done.stdout)
    return [{"input": name, "method": method, **found}]


def _units(size: int, seed: int) -> Iterable[Unit]:
    for turn in range(size):
        for name in INPUTS:
            for method in METHODS:
                yield Unit(f"{turn} {name} {method}", functools.partial(timed, name, method))


def report(rows: list[Row]) -> Report:
    """Medians over the turns; the limits; the ratios to the paper's method; and where the time goes."""
    names, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("input", "method"))
    found = {(name, method): _together(rows, name, method) for name in names for method in methods}
    others = [method for method in methods if method != "lubdub"]
    ratios = {what: _over(found, names, others, what) for what in ("median_s", "registration_s")}
    columns = ("median_s", "least_s", "most_s", "cpu_s", "first_run_s", "peak_MB", "verdict")
    lines = [(*both, *(numbers[column] for column in columns)) for both, numbers in found.items()]
    tables = (
        Table("Seconds from file to verdict, warm process", ("input", "method", *columns), lines),
        limits_table({name: found[name, "lubdub"] for name in names}),
        *(
            Table(title, ("input", *others), [(name, *ratios[what][name].values()) for name in names])
            for what, title in (
                ("median_s", "Time of lubdub over"),
                ("registration_s", "Time of lubdub over, reading and cleaning left out"),
            )
        ),
        stages_table(rows),
    )
    return Report(tables, {"time_ratios": ratios})


def _over(
    found: Mapping[tuple[str, str], Mapping[str, Any]], names: list[str], others: list[str], what: str
) -> dict[str, dict[str, float]]:
    """Input -> other method -> the default method's number over the other's."""
    return {name: {other: found[name, "lubdub"][what] / found[name, other][what] for other in others} for name in names}


def _together(rows: list[Row], name: str, method: str) -> dict[str, Any]:
    """One input and one method, all turns."""
    of_both = [row for row in rows if (row["input"], row["method"]) == (name, method)]
    seconds, work, first, memory = (
        np.array([row[key] for row in of_both]) for key in ("seconds", "cpu_s", "first_s", "peak_mb")
    )
    return {
        "median_s": float(np.median(seconds)),
        "least_s": float(seconds.min()),
        "most_s": float(seconds.max()),
        "cpu_s": float(np.median(work)),
        "registration_s": float(np.median([_after_cleaning(row["stages"]) for row in of_both])),
        "first_run_s": float(np.median(first)),
        "peak_MB": float(memory.max()),
        "verdict": of_both[0]["verdict"],
    }


def _after_cleaning(stages: Mapping[str, float]) -> float:
    return sum(seconds for stage, seconds in stages.items() if stage not in ("read", "clean"))


def limits_table(found: Mapping[str, Mapping[str, Any]]) -> Table:
    """What is promised of the default method, and whether this machine kept it."""
    lines: list[tuple[Cell, ...]] = []
    for name, numbers in found.items():
        kept = numbers["median_s"] <= LIMITS_S[name] and numbers["peak_MB"] <= LIMIT_MB
        said = "yes" if kept else "no"
        lines.append((name, numbers["median_s"], LIMITS_S[name], numbers["peak_MB"], LIMIT_MB, said))
    return Table("Limits", ("input", "median_s", "limit_s", "peak_MB", "limit_MB", "kept"), lines)


def stages_table(rows: list[Row]) -> Table:
    """Median seconds of each stage of the default method."""
    own = [row for row in rows if row["method"] == "lubdub"]
    stages = list(dict.fromkeys(stage for row in own for stage in row["stages"]))
    lines: list[tuple[Cell, ...]] = []
    for name in dict.fromkeys(row["input"] for row in own):
        of_input = [row["stages"] for row in own if row["input"] == name]
        lines.append((name, *(float(np.median([one.get(stage, 0.0) for one in of_input])) for stage in stages)))
    return Table("Where lubdub's time goes, median seconds", ("input", *stages), lines)


SPEED = Experiment("speed", "seconds and memory from file to verdict", 5, "how many turns", _units, report)
