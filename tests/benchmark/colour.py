"""`colour`: how much closer are suggested navels and nipples where the scan has colours, and what deceives them?

Nobody marks anything and nobody wears a sticker. Each person has areolas and a navel as `references/make/areolas.py`
draws them, from nearly none to strong, and is scanned once: by a phone's LiDAR, whose app lays six photographs over the
mesh, or by a TrueDepth camera as a cloud with a colour at each point. The same scan is then looked at without colours,
with them, made grey, and once more with a mole, a plaster over one nipple, a tattoo or the edge of a shadow, in turn.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from lubdub import stages
from lubdub.geometry.colour import Colouring, Tint
from lubdub.geometry.surface import Surface
from lubdub.landmarks.tint import tint_of
from lubdub.results import LANDMARK_NAMES, CleanScan, Patient, RawScan, ScanRefused
from lubdub.stickers import prepare
from references.make.areolas import coloured, with_mole, with_plaster, with_shadow, with_tattoo
from references.make.cameras import SCANNERS, Scene, Shot
from references.make.paint import Complexion, PhotoSettings, draw_complexion, laid_over, photographs, seen_by
from tests.benchmark.cohort import GROUPS, Places, draw_person, group_of, lay
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.measure import shipped_library

PHONES = ("phone LiDAR mesh", "TrueDepth, fused")
PIXELS_MM = (1.5, 2.0, 2.5)
DECEIVERS = ("mole", "plaster", "tattoo", "shadow")
SHAPE, COLOUR, GREY = "shape alone", "colour", "grey"
KINDS = {
    "nipples": ("nipple_left", "nipple_right"),
    "navel": ("navel",),
    "notch": ("suprasternal_notch",),
    "lower end of the breastbone": ("xiphisternum",),
}
VISIBLE = {"nearly none, under 0.15": (0.0, 0.15), "0.15 to 0.3": (0.15, 0.3), "strong, over 0.3": (0.3, 9.0)}
WORSE_MM, LOST_MM = 3.0, 100.0


@dataclass(frozen=True)
class Painted:
    """A scan, the truth in its coordinates (5, 3), and its colours by what deceives in them. darker: of the areolas."""

    raw: RawScan
    truth: np.ndarray
    mm_per_unit: float
    looks: dict[str, Colouring]
    patient: Patient
    darker: float


def photographed(seed: int, number: int) -> Painted:
    """A person's scan in all its colours."""
    subject, _ = draw_person(seed, number)
    random = np.random.default_rng([seed, number, 43])
    scene, places = lay(subject, random)
    plain = draw_complexion(random, scene.people, np.zeros((0, 3)), min(1.0, subject.sternum_mm / 150.0))
    skin = coloured(random, plain, places.landmarks[2:], subject.phenotype, subject.sternum_mm)
    shot = SCANNERS[PHONES[(number + number // len(GROUPS)) % 2]](scene, random)
    deceiver = DECEIVERS[(number + number // len(DECEIVERS)) % len(DECEIVERS)]
    other = _deceiving(deceiver, random, skin, scene)
    pixel_mm, light = PIXELS_MM[number % len(PIXELS_MM)], int(random.integers(2**31))
    looks = {
        name: _laid_on(shot, scene, places, one, PhotoSettings(pixel_mm=pixel_mm), np.random.default_rng(light))
        for name, one in ((COLOUR, skin), (deceiver, other))
    }
    looks[GREY] = _grey(looks[COLOUR])
    return Painted(
        RawScan(shot.surface, shot.file_type),
        shot.file_from_scene.apply(places.landmarks),
        1.0 / shot.file_from_scene.scale,
        looks,
        Patient(subject.phenotype.age_years, subject.phenotype.sex),
        float(np.mean([np.log(skin.tone[1] / patch.tone[1]) for patch in skin.patches[1:]])),
    )


def _deceiving(what: str, random: np.random.Generator, skin: Complexion, scene: Scene) -> Complexion:
    if what == "mole":
        return with_mole(random, skin, scene.people)
    if what == "tattoo":
        return with_tattoo(random, skin, scene.people)
    return with_plaster(random, skin) if what == "plaster" else with_shadow(random, skin)


def _laid_on(
    shot: Shot, scene: Scene, places: Places, skin: Complexion, settings: PhotoSettings, random: np.random.Generator
) -> Colouring:
    """The colours of a scan, from photographs of a skin."""
    back = shot.file_from_scene.inverse()
    mesh = Surface(back.apply(shot.surface.vertices), shot.surface.triangles)
    photos = photographs(scene.people, skin, places.landmarks[:2].mean(axis=0), random, settings)
    if not mesh.is_cloud:
        return laid_over(mesh, photos)
    normals = scene.people.normals[cKDTree(scene.people.vertices).query(mesh.vertices)[1]]
    return seen_by(photos, mesh.vertices, normals)


def _grey(colouring: Colouring) -> Colouring:
    def grey(colours: np.ndarray) -> np.ndarray:
        return np.repeat((colours @ [0.299, 0.587, 0.114])[..., None], 3, axis=-1).astype(np.uint8)

    vertices = None if colouring.vertices is None else grey(colouring.vertices)
    return replace(colouring, vertices=vertices, pictures=tuple(grey(picture) for picture in colouring.pictures))


def _rows(seed: int, number: int) -> list[Row]:
    painted, library = photographed(seed, number), shipped_library()
    who: Row = {"group": group_of(number).name, "number": number, "scanner": PHONES[(number + number // 10) % 2]}
    who["darker"] = painted.darker
    try:
        ready = prepare(painted.raw, None, {})
        laid = stages.lay_down(ready.scan, {}, library.basis, painted.patient)
    except ScanRefused as refusal:
        return [who | {"look": SHAPE, "refused": refusal.reason.code}]
    tints: dict[str, Tint | None] = {SHAPE: None}
    tints |= {name: tint_of(painted.raw.surface, one, ready.scan) for name, one in painted.looks.items()}
    rows = []
    for look, tint in tints.items():
        chest = stages.understand(replace(laid, tint=tint), painted.patient, "lubdub", library)
        row: Row = who | {"look": look, "refused": ""}
        for name, true in zip(LANDMARK_NAMES, painted.truth, strict=True):
            mark = chest.landmarks[name]
            row[f"{name}_mm"] = _gap(chest.scan, mark.position, true) * painted.mm_per_unit
            row[f"{name}_doubt_mm"] = mark.uncertainty_mm
        rows.append(row)
    return rows


def _gap(scan: CleanScan, place: np.ndarray, true: np.ndarray) -> float:
    return float(np.linalg.norm(scan.body_from_file.inverse().apply(place) - true))


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(size):
        yield Unit(f"{group_of(number).name} {number}", functools.partial(_rows, seed, number))


def report(rows: list[Row]) -> Report:
    """By landmark, by group, by how much shows, and by what deceives."""
    seen = [row for row in rows if not row["refused"]]
    people = {row["number"] for row in seen}
    lost = {row["number"] for row in seen if row["look"] == SHAPE and row["suprasternal_notch_mm"] > LOST_MM}
    words = (
        f"{len(people)} people; {len(rows) - len(seen)} more were refused because their shape does not say how "
        "they lie. "
        f"{len(lost)} of the {len(people)} were laid wrongly by their shape (the notch over {LOST_MM:g} mm off), "
        "which no colour mends. In mm to the true place on the skin; *within* is the share whose error is "
        "within the doubt said.\n"
        "The weights were chosen on other people (seed 901). Nothing was measured on people: how skin looks is "
        "drawn (`references/make/areolas.py`)."
    )
    by_group = {name: _of_group(seen, name) for name in (group.name for group in GROUPS)}
    by_dark = {name: [r for r in seen if low <= r["darker"] < high] for name, (low, high) in VISIBLE.items()}
    tables = (
        Table("By landmark", ("landmark", "seen by", *COLUMNS), _both(seen, KINDS)),
        Table("Nipples by group", ("group", "seen by", *COLUMNS), _split(by_group)),
        Table("Nipples by how much darker the areolas are", ("darker by", "seen by", *COLUMNS), _split(by_dark)),
        Table("What deceives", ("look", "landmark", "seen by", *COLUMNS, f"{WORSE_MM:g} mm worse"), _deceived(seen)),
    )
    numbers = {f"{kind}_{look}": summary(seen, look, kind) for kind in KINDS for look in (SHAPE, COLOUR)}
    return Report(tables, {**numbers, "grey_moves_mm": grey_moves(seen)}, words=words)


COLUMNS = ("marks", "median", "p95", "max", "within", "median doubt")


def summary(rows: Sequence[Row], look: str, kind: str) -> dict[str, Cell]:
    """Errors of one kind of landmark in one look."""
    chosen = [row for row in rows if row["look"] == look]
    off = np.array([row[f"{name}_mm"] for row in chosen for name in KINDS[kind]])
    doubt = np.array([row[f"{name}_doubt_mm"] for row in chosen for name in KINDS[kind]])
    if not len(off):
        return dict.fromkeys(COLUMNS)
    facts = (np.median(off), np.percentile(off, 95), off.max(), (off <= doubt).mean(), np.median(doubt))
    return {"marks": len(off), **{name: float(fact) for name, fact in zip(COLUMNS[1:], facts, strict=True)}}


def grey_moves(rows: Sequence[Row]) -> float:
    """The most that grey colours change of any error."""
    both = _paired(rows, GREY)
    return max((abs(grey[f"{n}_mm"] - bare[f"{n}_mm"]) for bare, grey in both for n in LANDMARK_NAMES), default=0.0)


def _paired(rows: Sequence[Row], look: str) -> list[tuple[Row, Row]]:
    """Each person of a look: as seen by shape alone, and so."""
    bare = {row["number"]: row for row in rows if row["look"] == SHAPE}
    return [(bare[row["number"]], row) for row in rows if row["look"] == look]


def _of_group(rows: Sequence[Row], name: str) -> list[Row]:
    return [row for row in rows if row["group"] == name]


def _both(rows: Sequence[Row], kinds: Iterable[str]) -> list[tuple[Cell, ...]]:
    return [(kind, look, *summary(rows, look, kind).values()) for kind in kinds for look in (SHAPE, COLOUR)]


def _split(parts: dict[str, list[Row]]) -> list[tuple[Cell, ...]]:
    return [
        (name, look, *summary(rows, look, "nipples").values())
        for name, rows in parts.items()
        for look in (SHAPE, COLOUR)
    ]


def _deceived(rows: Sequence[Row]) -> list[tuple[Cell, ...]]:
    """The people of each look, seen by shape alone and so; and how many marks are clearly worse."""
    lines: list[tuple[Cell, ...]] = []
    for look in (*DECEIVERS, GREY):
        both = _paired(rows, look)
        for kind in ("nipples", "navel"):
            gains = [so[f"{n}_mm"] - bare[f"{n}_mm"] for bare, so in both for n in KINDS[kind]]
            lines.append((look, kind, SHAPE, *summary([bare for bare, _ in both], SHAPE, kind).values(), None))
            worse = sum(gain > WORSE_MM for gain in gains)
            lines.append((look, kind, "colour", *summary([so for _, so in both], look, kind).values(), worse))
    return lines


COLOUR_EXPERIMENT = Experiment(
    "colour", "navel and nipples suggested with and without the skin's colours", 60, "people", _units, report
)
