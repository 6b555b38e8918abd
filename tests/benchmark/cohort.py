"""Unseen simulated people, their bones drawn under the skin with human spread, one noisy depth frame each.

They come from the same base mesh as the references (other parameters, other modifiers, other deformations), so
they flatter every method that knows that mesh. The bones and areas do not follow the skin: that part is honest.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Patient
from references.make.anatomy import drop_on_skin
from references.make.body import Workshop
from references.make.phenotype import Phenotype, Sex, draw_phenotype
from references.make.posture import bed_height
from references.make.scan import camera_towards, joined, simulate_depth_frame, smooth_skin
from references.make.scene import bed
from references.make.subject import Subject, draw_subject
from tests.benchmark.measure import Case

CLICK_MM = np.array([8.0, 8.0, 5.0, 5.0, 5.0])
"""How far clicks lie from the true place, root mean square: bones felt through the skin, then what one sees."""


MATTRESS_GIVES_MM = 8.0


@dataclass(frozen=True)
class Group:
    """Who belongs to it. parts: what is fixed in the phenotype; the rest is drawn."""

    name: str
    ages: tuple[float, float]
    sexes: tuple[Sex, ...] = ("male", "female")
    parts: tuple[tuple[str, float], ...] = ()


GROUPS = (
    Group("under 4", (0.0, 4.0)),
    Group("4-11", (4.0, 12.0)),
    Group("12-17", (12.0, 18.0)),
    Group("men", (18.0, 65.0), ("male",)),
    Group("women, small breasts", (18.0, 65.0), ("female",), (("cup", 0.1),)),
    Group("women, middle breasts", (18.0, 65.0), ("female",), (("cup", 0.5),)),
    Group("women, large breasts", (18.0, 65.0), ("female",), (("cup", 0.9),)),
    Group("over 65", (65.0, 90.0)),
    Group("obese", (18.0, 65.0), ("male", "female"), (("weight", 1.25),)),
    Group("very thin", (18.0, 65.0), ("male", "female"), (("weight", 0.05),)),
)


def group_of(number: int) -> Group:
    """The groups take turns."""
    return GROUPS[number % len(GROUPS)]


def cohort_case(seed: int, number: int) -> Case:
    """One of the people of a seed, always the same."""
    random = np.random.default_rng([seed, number])
    group = group_of(number)
    return _case(workshop(), random, group, f"{group.name} {number}")


@functools.cache
def workshop() -> Workshop:
    """MakeHuman and the shared topology, opened once."""
    return Workshop()


def _phenotype(random: np.random.Generator, group: Group) -> Phenotype:
    sex = group.sexes[int(random.integers(len(group.sexes)))]
    drawn = draw_phenotype(random, float(random.uniform(*group.ages)), sex)
    arms = (float(random.uniform(24, 40)), float(random.uniform(24, 40)))
    return replace(drawn, arms_deg=arms, **dict(group.parts))  # type: ignore[arg-type]


def _case(workshop: Workshop, random: np.random.Generator, group: Group, name: str) -> Case:
    subject = draw_subject(workshop, random, _phenotype(random, group))
    surface, file_from_body = _depth_frame(workshop, subject, random)
    noise = random.normal(size=(5, 2)) * CLICK_MM[:, None] / np.sqrt(2.0)
    mesh_landmarks = np.concatenate([subject.mesh_bones, subject.landmarks[2:]])
    phenotype = subject.phenotype

    def named(names: Sequence[str], places: np.ndarray) -> dict[Any, np.ndarray]:
        return dict(zip(names, file_from_body.apply(places), strict=True))

    return Case(
        name=name,
        group=group.name,
        data=bytes(trimesh.PointCloud(surface.vertices).export(file_type="ply")),
        patient=Patient(phenotype.age_years, phenotype.sex),
        clicks=named(LANDMARK_NAMES, _clicked(workshop, subject, subject.landmarks, noise)),
        landmarks=named(LANDMARK_NAMES, subject.landmarks),
        areas=named(AREA_NAMES, subject.areas),
        mm_per_unit=1.0 / file_from_body.scale,
        mesh_clicks=named(LANDMARK_NAMES, _clicked(workshop, subject, mesh_landmarks, noise)),
        mesh_areas=named(AREA_NAMES, subject.mesh_areas),
    )


def _depth_frame(workshop: Workshop, subject: Subject, random: np.random.Generator) -> tuple[Surface, Similarity]:
    """What an overhead depth camera sees of the person on a bed, and body -> file."""
    base = workshop.makehuman.base
    skin = smooth_skin(Surface(subject.whole[: base.skin_count], base.triangles))
    level = bed_height(subject.whole, workshop.torso) + MATTRESS_GIVES_MM
    length = float(np.linalg.norm(subject.landmarks[2]))
    centre = np.array([0.0, -0.45 * length, level + 100.0])
    above = np.array([*random.uniform(-60.0, 60.0, 2), random.uniform(0.8, 1.0) * (350.0 + 1.4 * length)])
    turn = random.uniform(-0.3, 0.3)
    camera = camera_towards(centre + above, centre, np.array([np.sin(turn), np.cos(turn), 0.0]))
    scene = joined([skin, bed(level, random, 520.0, -1300.0, 480.0)])
    return simulate_depth_frame(scene, camera, random)


def _clicked(workshop: Workshop, subject: Subject, landmarks: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """(5, 3) landmarks (5, 3) with noise (5, 2) beside them, on the skin."""
    skin = subject.whole[workshop.torso.indices]
    return drop_on_skin(landmarks[:, :2] + noise, skin, workshop.torso.triangles).positions
