"""`stickers`: are printed stickers found, is a mirrored scan caught, does bare skin ever show one?

Each person wears both stickers, a few millimetres beside the bones and turned anyhow, and is scanned by a phone's
LiDAR; its app lays six photographs over the mesh. Textures have 1, 1.5 and 2 mm a pixel in turn. The file is written,
read and prepared as any other; once more mirrored, once more without stickers.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.frames import Similarity
from lubdub.geometry.stickers import BONES, SMALL_UNTIL_YEARS, STICKERS
from lubdub.geometry.surface import Surface, unit
from lubdub.landmarks.sticker_reasons import CONTRADICTORY, MIRRORED
from lubdub.results import LANDMARK_NAMES, RawScan, ScanRefused
from lubdub.scans.read import read_scan
from lubdub.stickers import Prepared, prepare
from references.make.cameras import SCANNERS, Scene
from references.make.paint import PhotoSettings, Stuck, draw_complexion, laid_over, photographs
from references.make.subject import Subject
from tests.benchmark.cohort import Places, draw_person, group_of, lay
from tests.benchmark.experiment import Experiment, Report, Row, Table, Unit
from tests.writers import write_textured_glb

SCANNER = "phone LiDAR mesh"
PIXELS_MM = (1.0, 1.5, 2.0)
BESIDE_MM = 4.0
"""How far from the bone the sticker is put, one standard deviation each way: it is to be found where it is."""
SIDES = {"as scanned": np.ones(3), "mirrored": np.array([-1.0, 1.0, 1.0])}


@dataclass(frozen=True)
class Worn:
    """A file with its truth: the stickers in the file's coordinates; places (k, 3) in the order of `stuck`."""

    raw: RawScan
    stuck: tuple[Stuck, ...]
    file_from_scene: Similarity


def wear(subject: Subject, scene: Scene, places: Places, random: np.random.Generator) -> tuple[Stuck, ...]:
    """Both stickers on the skin near the bones."""
    size = "small" if subject.phenotype.age_years < SMALL_UNTIL_YEARS else "large"
    tree, stuck = cKDTree(scene.people.vertices), []
    for sticker in (one for one in STICKERS if one.size == size):
        bone = places.landmarks[LANDMARK_NAMES.index(sticker.bone)]
        place = scene.people.vertices[tree.query(bone + [*random.normal(size=2) * BESIDE_MM, 0.0])[1]]
        under = tree.query_ball_point(place, 0.6 * sticker.diameter_mm)
        outward = unit(scene.people.normals[under].mean(axis=0))
        stuck.append(Stuck(sticker, place, outward, float(random.uniform(0, 2 * np.pi))))
    return tuple(stuck)


def photographed(seed: int, number: int, pixel_mm: float, is_bare: bool) -> Worn:
    """A person's scan, with the stickers or without."""
    subject, _ = draw_person(seed, number)
    random = np.random.default_rng([seed, number, 41])
    scene, places = lay(subject, random)
    stuck = () if is_bare else wear(subject, scene, places, random)
    skin = draw_complexion(random, scene.people, places.landmarks[3:], min(1.0, subject.sternum_mm / 150.0), stuck)
    shot = SCANNERS[SCANNER](scene, random)
    mesh = Surface(shot.file_from_scene.inverse().apply(shot.surface.vertices), shot.surface.triangles)
    settings = PhotoSettings(pixel_mm=pixel_mm)
    photos = photographs(scene.people, skin, places.landmarks[:2].mean(axis=0), random, settings)
    return Worn(RawScan(shot.surface, "glb", colouring=laid_over(mesh, photos)), stuck, shot.file_from_scene)


def _rows(seed: int, number: int) -> list[Row]:
    pixel_mm = PIXELS_MM[number % len(PIXELS_MM)]
    rows = []
    for is_bare in (False, True):
        worn = photographed(seed, number, pixel_mm, is_bare)
        for side, flip in SIDES.items():
            row: Row = {"group": group_of(number).name, "number": number, "pixel_mm": pixel_mm}
            row |= {"wears": "nothing" if is_bare else "stickers", "side": side}
            rows.append(row | _outcome(worn, flip))
    return rows


def _outcome(worn: Worn, flip: np.ndarray) -> Row:
    assert worn.raw.colouring is not None
    surface = Surface(worn.raw.surface.vertices * flip, worn.raw.surface.triangles)
    try:
        ready = prepare(read_scan(write_textured_glb(surface, worn.raw.colouring)), None, {})
    except ScanRefused as refusal:
        return {"refused": refusal.reason.code}
    return {"refused": "", "found": len(ready.proof.found) if ready.proof else 0, **_measured(ready, worn)}


def _measured(ready: Prepared, worn: Worn) -> Row:
    """How far each sticker is from where it was put, in space and along the skin, and how true its size is."""
    row: Row = {}
    mm = ready.scan.unit.mm_per_unit
    for stuck in worn.stuck:
        if stuck.sticker.bone in ready.by_sticker:
            off = (ready.marked[stuck.sticker.bone] - worn.file_from_scene.apply(stuck.position)) * mm
            normal = worn.file_from_scene.turn(stuck.normal)
            row[f"{stuck.sticker.bone}_mm"] = float(np.linalg.norm(off))
            row[f"{stuck.sticker.bone}_along_mm"] = float(np.linalg.norm(off - (off @ normal) * normal))
    if ready.proof is not None:
        row["scale"] = ready.proof.scale / (worn.file_from_scene.scale * mm)
    return row


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(size):
        yield Unit(f"{group_of(number).name} {number}", functools.partial(_rows, seed, number))


def report(rows: list[Row]) -> Report:
    """Found, near enough, caught, and imagined; by the fineness of the texture."""
    levels: dict[str, list[Row]] = {f"{mm:g} mm a pixel": [r for r in rows if r["pixel_mm"] == mm] for mm in PIXELS_MM}
    lines = {name: numbers(chosen) for name, chosen in {**levels, "all": rows}.items() if chosen}
    table = Table(
        "Printed stickers", ("texture", *lines["all"]), [(name, *line.values()) for name, line in lines.items()]
    )
    return Report((table,), lines["all"])


def numbers(rows: Sequence[Row]) -> dict[str, float | int]:
    """What is claimed, out of rows."""
    worn = [row for row in rows if row["wears"] == "stickers" and row["side"] == "as scanned"]
    mirrored = [row for row in rows if row["wears"] == "stickers" and row["side"] == "mirrored"]
    bare = [row for row in rows if row["wears"] == "nothing"]
    off = np.array([row[f"{bone}_mm"] for row in worn for bone in BONES if f"{bone}_mm" in row] or [np.nan])
    along = np.array([row[f"{bone}_along_mm"] for row in worn for bone in BONES if f"{bone}_mm" in row] or [np.nan])
    scale = np.array([row["scale"] for row in worn if "scale" in row] or [np.nan])
    return {
        "scans": len(worn),
        "found_share": sum(row.get("found", 0) for row in worn) / max(2 * len(worn), 1),
        "some_found_share": float(np.mean([row.get("found", 0) > 0 for row in worn] or [np.nan])),
        "median_mm": float(np.median(off)),
        "p95_mm": float(np.percentile(off, 95)),
        "max_mm": float(off.max()),
        "within_3_mm_share": float((off <= 3.0).mean()),
        "along_skin_p95_mm": float(np.percentile(along, 95)),
        "largest_scale_error": float(np.abs(scale - 1).max()),
        "called_mirrored_wrongly": sum(row["refused"] in (MIRRORED.code, CONTRADICTORY.code) for row in worn),
        "mirrored_scans": len(mirrored),
        "mirrored_caught_share": float(np.mean([row["refused"] == MIRRORED.code for row in mirrored] or [np.nan])),
        "mirrored_believed": sum(row.get("found", 0) > 0 for row in mirrored),
        "bare_scans": len(bare),
        "imagined_on_bare_skin": sum(row.get("found", 0) + (row["refused"] == MIRRORED.code) for row in bare),
    }


STICKERS_EXPERIMENT = Experiment(
    "stickers", "printed stickers found, mirrored scans caught, bare skin left alone", 30, "people", _units, report
)
