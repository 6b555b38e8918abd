"""Three demo scans of people who are in no reference: a depth frame, a phone's mesh, a scanner's mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.results import AREA_NAMES, LANDMARK_NAMES
from references.make.anatomy import drop_on_skin
from references.make.body import Workshop
from references.make.files import write, write_json
from references.make.phenotype import Phenotype
from references.make.posture import bed_height
from references.make.scan import (
    camera_towards,
    joined,
    simulate_depth_frame,
    simulate_phone_mesh,
    simulate_scanner_mesh,
    smooth_skin,
)
from references.make.scene import bed, blanket, soft_toy
from references.make.subject import Subject, draw_subject

CLICK_MM = 4.0
"""How far a click lies from the true place, root mean square, along the skin."""
MATTRESS_GIVES_MM = 8.0


@dataclass(frozen=True)
class Demo:
    """A scan ready to be written. surface: in the file's coordinates; file_from_body: what put it there."""

    name: str
    file_name: str
    subject: Subject
    surface: Surface
    file_from_body: Similarity


def write_demos(workshop: Workshop, folder: Path) -> None:
    """`demo/<name>/`: the scan, landmarks.json, patient.json, and truth.json which the product never reads."""
    for number, make in enumerate((_overhead_bed, _phone_child, _scanner_woman)):
        random = np.random.default_rng([2026, 12, number])
        demo = make(workshop, random)
        _write(workshop, demo, random, folder / "demo" / demo.name)


def _overhead_bed(workshop: Workshop, random: np.random.Generator) -> Demo:
    man = Phenotype(38.0, "male", 1790.0, muscle=0.55, weight=0.62, height=0.52, proportions=0.6, arms_deg=(30.0, 34.0))
    subject = draw_subject(workshop, random, man)
    skin, level = _skin(workshop, subject), _mattress(workshop, subject)
    scene = joined([skin, bed(level, random, 520.0, -1300.0, 480.0)])
    centre = np.array([10.0, -170.0, level + 100.0])
    up = np.array([np.sin(0.2), np.cos(0.2), 0.0])
    camera = camera_towards(centre + [55.0, -70.0, 860.0], centre, up)
    surface, file_from_body = simulate_depth_frame(scene, camera, random)
    return Demo("overhead-bed", "overhead-bed.ply", subject, surface, file_from_body)


def _phone_child(workshop: Workshop, random: np.random.Generator) -> Demo:
    boy = Phenotype(6.2, "male", 1165.0, muscle=0.45, weight=0.42, proportions=0.4, arms_deg=(27.0, 31.0))
    subject = draw_subject(workshop, random, boy)
    skin, level = _skin(workshop, subject), _mattress(workshop, subject)
    mattress = bed(level, random, 420.0, -700.0, 330.0)
    cover = blanket(joined([skin, mattress]), random, 330.0, -620.0, subject.landmarks[2, 1] - 45.0)
    toy = soft_toy(np.array([-265.0, -60.0, level + 42.0]), 52.0)
    scene = joined([skin, mattress, cover, toy])
    centre = np.array([0.0, -110.0, level + 110.0])
    mesh = _boxed(simulate_phone_mesh(scene, centre, random), (-330.0, 330.0), (-400.0, 120.0))
    turn = np.deg2rad(37.0)
    head, front = np.array([np.cos(turn), 0.0, np.sin(turn)]), np.array([0.0, 1.0, 0.0])
    rotation = np.stack([np.cross(head, front), head, front], axis=1)
    file_from_body = Similarity(0.001, rotation, np.array([0.31, 0.74, -0.52]))
    surface = Surface(file_from_body.apply(mesh.vertices), mesh.triangles)
    return Demo("phone-child", "phone-child.glb", subject, surface, file_from_body)


def _scanner_woman(workshop: Workshop, random: np.random.Generator) -> Demo:
    woman = Phenotype(36.0, "female", 1672.0, muscle=0.45, weight=0.55, cup=0.62, firmness=0.4, arms_deg=(28.0, 28.0))
    subject = draw_subject(workshop, random, woman)
    torso = Surface(subject.whole[workshop.torso.indices], workshop.torso.triangles)
    mesh = simulate_scanner_mesh(smooth_skin(torso), random)
    rotation, _ = np.linalg.qr(random.normal(size=(3, 3)))
    rotation = rotation * np.sign(np.linalg.det(rotation))
    file_from_body = Similarity(1.0, rotation, np.array([412.0, -95.0, 1030.0]))
    surface = Surface(file_from_body.apply(mesh.vertices), mesh.triangles)
    return Demo("scanner-woman", "scanner-woman.stl", subject, surface, file_from_body)


def _skin(workshop: Workshop, subject: Subject) -> Surface:
    base = workshop.makehuman.base
    return smooth_skin(Surface(subject.whole[: base.skin_count], base.triangles))


def _mattress(workshop: Workshop, subject: Subject) -> float:
    return bed_height(subject.whole, workshop.torso) + MATTRESS_GIVES_MM


def _boxed(surface: Surface, across: tuple[float, float], along: tuple[float, float]) -> Surface:
    low, high = np.array([across[0], along[0]]), np.array([across[1], along[1]])
    place = surface.vertices[:, :2]
    return surface.kept(((place > low) & (place < high)).all(axis=1))


def clicked(workshop: Workshop, subject: Subject, random: np.random.Generator, click_mm: float) -> np.ndarray:
    """(5, 3) the landmarks as a person would click them: beside the true place, on the skin."""
    noise = random.normal(size=(5, 2)) * click_mm / np.sqrt(2.0)
    skin = subject.whole[workshop.torso.indices]
    return drop_on_skin(subject.landmarks[:, :2] + noise, skin, workshop.torso.triangles).positions


def _write(workshop: Workshop, demo: Demo, random: np.random.Generator, folder: Path) -> None:
    subject = demo.subject
    clicks = demo.file_from_body.apply(clicked(workshop, subject, random, CLICK_MM))
    phenotype = subject.phenotype
    write(folder / demo.file_name, _encoded(demo))
    write_json(folder / "landmarks.json", _named(LANDMARK_NAMES, clicks))
    patient = {"age_years": phenotype.age_years, "sex": phenotype.sex, "posture": "supine"}
    write_json(folder / "patient.json", patient)
    truth = {
        "areas": _named(AREA_NAMES, demo.file_from_body.apply(subject.areas)),
        "landmarks": _named(LANDMARK_NAMES, demo.file_from_body.apply(subject.landmarks)),
        "mm_per_unit": round(1.0 / demo.file_from_body.scale, 6),
        "sternum_mm": round(subject.sternum_mm, 2),
        "recipe": phenotype.to_json(),
        "note": "Simulated. For measuring only; nothing in the product reads this file.",
    }
    write_json(folder / "truth.json", truth)


def _named(names: tuple[str, ...], positions: np.ndarray) -> dict[str, list[float]]:
    return {name: [round(float(value), 5) for value in place] for name, place in zip(names, positions, strict=True)}


def _encoded(demo: Demo) -> bytes:
    vertices = demo.surface.vertices.astype(np.float32)
    if demo.surface.is_cloud:
        return _ply(vertices)
    mesh = trimesh.Trimesh(vertices, demo.surface.triangles, process=False)
    return bytes(mesh.export(file_type=demo.file_name.rsplit(".", 1)[1]))


def _ply(vertices: np.ndarray) -> bytes:
    """A binary PLY cloud. vertices: (n, 3) float32."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    lines += [*(f"property float {axis}" for axis in "xyz"), "end_header", ""]
    return "\n".join(lines).encode() + vertices.astype("<f4").tobytes()
