"""`./lubdub benchmark peers`: registration alone, against trimesh's two non-rigid registrations at 25,000 vertices.

Every contender is given the same cleaned scan (at most 25,000 points), the same five clicks, the same reference body
(the one of least Chamfer distance), its front cut into 25,000 vertices, and the same rigid start from the clicks.
trimesh wants a mesh to register to: it gets those points joined as the product joins them for showing, a flat
Delaunay triangulation along the view with its long edges dropped. Its steps, weights and thresholds are its defaults.
`lubdub` needs no reference: it bends its shape basis and lays the result on the skin.

What is carried over are the average body's four areas, as the skin carries them between a body's own five landmarks:
on the topology that reference, shape basis and simulated person share, the skin is slid until the shared landmarks lie
on the body's own, as the bodies were from which the basis is drawn. Bones follow the skin here, and clicks lie about
them. So the true mesh says where each area lies on this person, and only the registration can miss it. The
error is that distance. Reading, cleaning and choosing are not timed. Where trimesh loses its footing and raises an
error, that is a row too, without numbers.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lubdub import stages
from lubdub.fitting.paper import fit_paper, front_of
from lubdub.fitting.schedule import FAITHFUL
from lubdub.fitting.shape import carried
from lubdub.geometry.anchors import anchored
from lubdub.geometry.frames import Similarity
from lubdub.geometry.rigid import best_rigid
from lubdub.geometry.surface import Surface
from lubdub.library.choose import choose
from lubdub.library.load import load_library
from lubdub.methods import Chest
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, Library, Reference, ShapeBasis
from lubdub.scans.clean import clean
from lubdub.scans.read import read_scan
from lubdub.scans.units import find_unit
from tests.benchmark.cohort import areas_carried_by, cohort_case, group_of
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import Case

Places = Mapping[AreaName, np.ndarray]
OURS = "lubdub"
ERROR_SHARE, TIME_SHARE = 0.5, 1 / 50
"""What is promised against either of trimesh's."""


@dataclass(frozen=True)
class Ground:
    """One case made ready for every contender. laid, chest: the cleaned scan; truth: mm, in the chest's frame."""

    case: Case
    laid: stages.Laid
    chest: Chest
    library: Library
    reference: Reference
    start: Similarity
    truth: Places


def ground_of(case: Case, library: Library) -> Ground:
    """Read, clean, turn upright, choose the reference and lay it on by the clicks."""
    basis = library.basis
    raw = read_scan(case.data)
    scan = clean(raw, find_unit(raw, None, case.mesh_clicks), case.mesh_clicks)
    laid = stages.lay_down(scan, case.mesh_clicks, basis, case.patient)
    chest = stages.understand(laid, case.patient, "paper", library)
    reference = _marked(choose(chest.scan, chest.landmarks, library.references).selected, basis)
    source = np.array([reference.landmarks[name] for name in LANDMARK_NAMES])
    target = np.array([chest.landmarks[name].position for name in LANDMARK_NAMES])
    truth = {name: chest.scan.body_from_file.apply(case.mesh_areas[name]) for name in AREA_NAMES}
    return Ground(case, laid, chest, library, reference, best_rigid(source, target), truth)


def _marked(reference: Reference, basis: ShapeBasis) -> Reference:
    """The reference with its areas where its skin carries those of the average body."""
    landmarks = np.array([reference.landmarks[name] for name in LANDMARK_NAMES])
    areas = areas_carried_by(reference.surface.vertices, landmarks, basis)
    return replace(reference, areas=dict(zip(AREA_NAMES, areas, strict=True)))


def by_lubdub(ground: Ground, vertices: int) -> Places:
    """The product's registration: the shape basis, then the overlay."""
    chest = stages.understand(ground.laid, ground.case.patient, OURS, ground.library)
    chest = stages.with_overlay(chest, OURS, ground.library)
    if chest.overlay is None:
        raise ValueError("there is no overlay")
    to_ground = ground.chest.scan.body_from_file.after(chest.scan.body_from_file.inverse())
    areas = carried(chest.overlay.surface, ground.library.basis).areas
    return {name: to_ground.apply(place) for name, place in areas.items()}


def by_paper(ground: Ground, vertices: int) -> Places:
    """The paper's N-ICP, given all five clicks like the others."""
    settings = replace(FAITHFUL, source_vertices=vertices, landmarks=LANDMARK_NAMES)
    chest = ground.chest
    return fit_paper(chest.scan, chest.landmarks, ground.reference, ground.start, settings).areas


def by_nothing(ground: Ground, vertices: int) -> Places:
    """The start itself."""
    return {name: ground.start.apply(place) for name, place in ground.reference.areas.items()}


def by_trimesh(register: str, ground: Ground, vertices: int) -> Places:
    """`trimesh.registration.nricp_amberg` or `nricp_sumner` as they come."""
    import trimesh

    front = front_of(ground.reference, vertices)
    source = trimesh.Trimesh(ground.start.apply(front.vertices), front.triangles, process=False)
    skin = ground.chest.scan.display
    target = trimesh.Trimesh(skin.vertices, skin.triangles, process=False)
    names = [name for name in LANDMARK_NAMES if name in ground.chest.landmarks]
    marks = _on_triangles(front, np.array([ground.reference.landmarks[name] for name in names]))
    clicked = np.array([ground.chest.landmarks[name].position for name in names])
    moved = getattr(trimesh.registration, register)(source, target, marks, clicked)
    areas = anchored(front, np.array([ground.reference.areas[name] for name in AREA_NAMES]))
    return dict(zip(AREA_NAMES, areas.on(np.asarray(moved)), strict=True))


def _on_triangles(surface: Surface, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k,) triangles and (k, 3) barycentric weights of places on a surface, as trimesh wants landmarks."""
    anchors = anchored(surface, points)
    triangles = [int(np.flatnonzero((surface.triangles == corners).all(axis=1))[0]) for corners in anchors.corners]
    return np.array(triangles), anchors.weights


CONTENDERS: Mapping[str, Callable[[Ground, int], Places]] = {
    "rigid start": by_nothing,
    OURS: by_lubdub,
    "paper's N-ICP, ours": by_paper,
    "trimesh nricp_amberg": functools.partial(by_trimesh, "nricp_amberg"),
    "trimesh nricp_sumner": functools.partial(by_trimesh, "nricp_sumner"),
}
PEERS = tuple(name for name in CONTENDERS if name.startswith("trimesh"))
SOURCE_VERTICES = 25_000


@functools.lru_cache(maxsize=1)
def _ground(seed: int, number: int) -> Ground:
    library = load_library()
    return ground_of(cohort_case(seed, number), library)


def measured(make: Callable[[], Ground], name: str, vertices: int) -> list[Row]:
    """One contender on one case. cpu_s: the work of all cores, whatever else the machine did."""
    ground = make()
    facts: Row = {"contender": name, "case": ground.case.name, "points": len(ground.chest.scan.points)}
    begun, worked = time.perf_counter(), time.process_time()
    try:
        found = CONTENDERS[name](ground, vertices)
    except (ArithmeticError, ValueError, IndexError, RuntimeError) as error:
        return [{**facts, "failed": f"{type(error).__name__}: {error}"[:200]}]
    times = {"seconds": time.perf_counter() - begun, "cpu_s": time.process_time() - worked}
    errors = {f"{area}_mm": float(np.linalg.norm(found[area] - ground.truth[area])) for area in AREA_NAMES}
    return [{**facts, **{key: round(value, 4) for key, value in {**times, **errors}.items()}}]


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(size):
        make = functools.partial(_ground, seed, number)
        for name in CONTENDERS:
            key = f"{group_of(number).name} {number}, {name}"
            yield Unit(key, functools.partial(measured, make, name, SOURCE_VERTICES))


def report(rows: list[Row]) -> Report:
    """A line for each contender, and ours over each of the peers' on the cases that both finished."""
    lines: list[tuple[Cell, ...]] = []
    for name in dict.fromkeys(row["contender"] for row in rows):
        own = [row for row in rows if row["contender"] == name]
        done = [row for row in own if "seconds" in row]
        numbers: tuple[Cell, ...] = (None,) * 6
        if done:
            errors = errors_of(done)
            seconds, work = (float(np.median([row[key] for row in done])) for key in ("seconds", "cpu_s"))
            parts = (errors.mean(), np.median(errors), np.percentile(errors, 95), errors.max())
            numbers = (*(float(part) for part in parts), seconds, work)
        lines.append((name, len(done), len(own) - len(done), *numbers))
    columns = ("contender", "cases", "failed", "mean_mm", "median_mm", "p95_mm", "max_mm", "median_s", "cpu_s")
    met = {row["contender"] for row in rows}
    against = [(name, *shares_of(rows, OURS, name)) for name in PEERS if name in met]
    ratio_columns = ("peer", "cases", "error", "time", "work", "promise kept")
    tables = (
        Table("Registration alone, one source, one start, one scan", columns, lines),
        Table(f"{OURS} over each peer (promised: error {ERROR_SHARE}, time {TIME_SHARE})", ratio_columns, against),
    )
    return Report(tables, {"over": {str(line[0]): line[1:5] for line in against}})


def shares_of(rows: list[Row], ours: str, theirs: str) -> tuple[Cell, ...]:
    """Cases, mean error, median time and median work of ours over theirs, and whether that is what was promised."""
    done = {(row["contender"], row["case"]): row for row in rows if "seconds" in row}
    cases = [case for contender, case in done if contender == theirs and (ours, case) in done]
    if not cases:
        return (0, None, None, None, None)
    mine, other = ([done[contender, case] for case in cases] for contender in (ours, theirs))
    error = float(errors_of(mine).mean() / errors_of(other).mean())
    times = [
        float(np.median([a[key] / b[key] for a, b in zip(mine, other, strict=True)])) for key in ("seconds", "cpu_s")
    ]
    kept = error <= ERROR_SHARE and times[0] <= TIME_SHARE
    return (len(cases), error, f"{times[0]:.4f}", f"{times[1]:.4f}", "yes" if kept else "no")


def errors_of(rows: list[Row]) -> np.ndarray:
    """All errors of all areas, mm."""
    return np.array([row[f"{name}_mm"] for row in rows for name in AREA_NAMES])


PEERS_EXPERIMENT = Experiment(
    "peers", "registration alone against trimesh's at 25,000 vertices", 5, "how many people", _units, report
)
