"""`./lubdub benchmark selection`: does choosing a reference stay quick, and right, when the library grows?

Libraries of 24, 240 and 2,400 bodies are drawn from the shape basis, from infants to tall adults. Bodies drawn the
same way, but not in the library, are then looked up: by the product (`rank_by_shape`) and by comparing every
reference. `choose`, the paper's way over a scan, lays every reference on one demo scan; its answers are not judged
here, for the truth is not known.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from unittest import mock

import numpy as np

from lubdub import stages
from lubdub.geometry.surface import Surface, carry
from lubdub.library import nearest
from lubdub.library.choose import choose
from lubdub.library.load import load_library
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Reference, ShapeBasis
from lubdub.scans.clean import clean
from lubdub.scans.read import read_scan
from lubdub.scans.units import find_unit
from tests.benchmark.demo import demo_cases
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit

LIBRARY_SIZES = (24, 240, 2400)
SMALLEST, LARGEST = 0.35, 1.1
"""Of an average adult: a newborn, and a tall man."""
LIMIT_S = 0.5
CHOOSE_DEMO = "phone-child"


def drawn_references(basis: ShapeBasis, count: int, random: np.random.Generator) -> tuple[Reference, ...]:
    """Bodies of the basis' kind, every size equally likely in proportion."""
    sizes = np.exp(random.uniform(np.log(SMALLEST), np.log(LARGEST), count))
    return tuple(_drawn(basis, f"drawn-{number}", size, random) for number, size in enumerate(sizes))


def _drawn(basis: ShapeBasis, name: str, size: float, random: np.random.Generator) -> Reference:
    coefficients = random.standard_normal(len(basis.modes))
    vertices = size * (basis.mean + np.tensordot(coefficients, basis.modes, axes=1))
    landmarks = carry(basis.landmark_weights, basis.landmark_corners, vertices)
    areas = carry(basis.area_weights[0], basis.area_corners[0], vertices)
    return Reference(
        name,
        Surface(vertices, basis.triangles),
        dict(zip(LANDMARK_NAMES, landmarks, strict=True)),
        dict(zip(AREA_NAMES, areas, strict=True)),
        {},
    )


@dataclass(frozen=True)
class Draw:
    """A library, and bodies to look up in it."""

    references: tuple[Reference, ...]
    bodies: tuple[Reference, ...]


@functools.lru_cache(maxsize=1)
def _draw(library_size: int, seed: int, bodies: int) -> Draw:
    random = np.random.default_rng([seed, library_size])
    basis = load_library().basis
    return Draw(drawn_references(basis, library_size, random), drawn_references(basis, bodies, random))


def looked_up(library_size: int, seed: int, bodies: int, number: int) -> list[Row]:
    """One body: the product's way against comparing with every reference."""
    draw = _draw(library_size, seed, bodies)
    body = draw.bodies[number].surface
    begun = time.perf_counter()
    nearest.index_of(draw.references)  # once for a library, not for every body
    made = time.perf_counter() - begun
    begun = time.perf_counter()
    found = nearest.rank_by_shape(body, draw.references)
    seconds = time.perf_counter() - begun
    begun = time.perf_counter()
    with mock.patch.object(nearest, "SETTINGS", nearest.NearestSettings(most_compared=library_size)):
        everything = nearest.rank_by_shape(body, draw.references)
    exhaustive = time.perf_counter() - begun
    rank = [one.id for one in everything].index(found[0].id) + 1
    excess = found[0].chamfer_mm / everything[0].chamfer_mm - 1
    times = {"seconds": round(seconds, 5), "exhaustive_s": round(exhaustive, 5), "index_s": round(made, 5)}
    return [{"way": "rank_by_shape", "references": library_size, "rank": rank, "excess": round(excess, 5), **times}]


def laid_on(library_size: int, seed: int, bodies: int) -> list[Row]:
    """The paper's way over one scan."""
    (case,) = (case for case in demo_cases() if case.name == CHOOSE_DEMO)
    library, raw = load_library(), read_scan(case.data)
    scan = clean(raw, find_unit(raw, None, case.clicks), case.clicks)
    chest = stages.understand(
        stages.lay_down(scan, case.clicks, library.basis, case.patient), case.patient, "paper", library
    )
    references = _draw(library_size, seed, bodies).references
    begun = time.perf_counter()
    choose(chest.scan, chest.landmarks, references)
    return [{"way": "choose", "references": library_size, "seconds": round(time.perf_counter() - begun, 5)}]


def _units(size: int, seed: int, library_sizes: Sequence[int] = LIBRARY_SIZES) -> Iterable[Unit]:
    for library_size in library_sizes:
        for number in range(size):
            work = functools.partial(looked_up, library_size, seed, size, number)
            yield Unit(f"{library_size} {number}", work)
        yield Unit(f"{library_size} choose", functools.partial(laid_on, library_size, seed, size))


def report(rows: list[Row]) -> Report:
    """A line for each library size; growth is the time against the next smaller library's."""
    lines: list[tuple[Cell, ...]] = []
    medians: list[float] = []
    for count in dict.fromkeys(row["references"] for row in rows):
        of_size = [row for row in rows if row["references"] == count]
        own = [row for row in of_size if row["way"] == "rank_by_shape"]
        laid = [row["seconds"] for row in of_size if row["way"] == "choose"]
        columns = {name: np.array([row[name] for row in own]) for name in ("seconds", "exhaustive_s", "rank", "excess")}
        medians.append(float(np.median(columns["seconds"])))
        growth = medians[-1] / medians[-2] if len(medians) > 1 else None
        quality = (float((columns["rank"] == 1).mean()), int(columns["rank"].max()), float(columns["excess"].max()))
        index = max(row["index_s"] for row in own)
        times = (medians[-1], growth, float(np.median(columns["exhaustive_s"])), index)
        lines.append((count, *times, *quality, laid[0] if laid else None))
    columns_shown = ("references", "median_s", "growth", "every one_s", "index once_s", "best found", "worst rank")
    title = f"Choice among many references (limit {LIMIT_S} s)"
    table = Table(title, (*columns_shown, "worst excess", "the paper's choose_s"), lines)
    return Report((table,), {"slowest_median_s": max(medians), "limit_s": LIMIT_S})


SELECTION = Experiment(
    "selection", "choice among 24, 240 and 2,400 references", 10, "how many bodies are looked up", _units, report
)
