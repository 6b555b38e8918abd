"""Scans of simulated people from which signs of landmarks are learned: nobody of the cohort, nobody of the basis.

They have only the modifiers that the basis knows; nipples, breasts and navel slid as far as in people.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.surface import Surface
from lubdub.scans.clean import clean
from lubdub.scans.read import read_scan
from lubdub.scans.units import find_unit
from references.make.body import Body, Workshop
from references.make.cameras import SCANNERS, Scene
from references.make.makehuman import MODELLED
from references.make.moment import breathe, draw_moment, raised_bed, tilted
from references.make.phenotype import Phenotype, Sex, draw_phenotype
from references.make.posture import bed_height, draw_lying
from references.make.scan import smooth_skin
from references.make.scene import bed
from references.make.subject import bent_and_slid

MATTRESS_GIVES_MM = 8.0
TRUNK = 0.5
"""Scanned skin whose nearest vertex is less of the trunk than this belongs to an arm."""


@dataclass(frozen=True)
class Sighting:
    """A cleaned scan in the body frame with its truth. points, normals: (n, 3) of the trunk; marks: (3, 3) navel, left
    and right nipple on the skin; sternum_mm: S."""

    points: np.ndarray
    normals: np.ndarray
    marks: np.ndarray
    sternum_mm: float


@dataclass(frozen=True)
class SightingSettings:
    """Who is scanned. adult_weight: from very thin to obese; bare_people: others, whose skin is taken as it is."""

    seed: int = 2027
    people: int = 130
    bare_people: int = 40
    scans_each: int = 2
    children_share: float = 0.35
    modifier_reach: float = 0.5
    adult_weight: tuple[float, float] = (0.05, 1.25)


def sightings(workshop: Workshop, settings: SightingSettings | None = None) -> Iterator[Sighting]:
    """Each person some times, each time with nipples and navel elsewhere; the scanners take turns."""
    settings = settings or SightingSettings()
    random, scanners = np.random.default_rng(settings.seed), list(SCANNERS)
    for number in range(settings.people):
        body = workshop.body(_phenotype(random, settings), draw_lying(random))
        for scan in range(settings.scans_each):
            turn = settings.scans_each * number + scan
            yield _sighting(workshop, body, scanners[(turn + turn // len(scanners)) % len(scanners)], random)
    random = np.random.default_rng([settings.seed, 1])
    for _ in range(settings.bare_people):
        body = workshop.body(_phenotype(random, settings), draw_lying(random))
        for _ in range(settings.scans_each):
            yield _bare(workshop, body, random)


def _phenotype(random: np.random.Generator, settings: SightingSettings) -> Phenotype:
    child = random.random() < settings.children_share
    age = float(random.uniform(0.0, 16.0) if child else random.uniform(16.0, 90.0))
    sex: Sex = "female" if random.random() < 0.5 else "male"
    drawn = draw_phenotype(random, age, sex)
    weight = drawn.weight if child else float(random.uniform(*settings.adult_weight))
    modifiers = {name: float(random.uniform(-1, 1) * settings.modifier_reach) for name in MODELLED}
    arms = (float(random.uniform(24, 40)), float(random.uniform(24, 40)))
    return replace(drawn, weight=weight, modifiers=modifiers, arms_deg=arms)


def _sighting(workshop: Workshop, body: Body, scanner: str, random: np.random.Generator) -> Sighting:
    """The body bent, slid and laid on a bed, scanned, cleaned as any scan is, and turned back."""
    torso = workshop.torso
    whole = bent_and_slid(workshop, random, body)
    scene, whole, marks = _laid(workshop, whole, body.sternum_mm, random)
    shot = SCANNERS[scanner](scene, random)
    raw = read_scan(shot.encoded())
    scan = clean(raw, find_unit(raw, None, {}), {})
    back = shot.file_from_scene.inverse().after(scan.body_from_file.inverse())
    points = back.apply(scan.points)
    kept = torso.trunk[cKDTree(whole[torso.indices]).query(points)[1]] > TRUNK
    return Sighting(points[kept], back.turn(scan.normals)[kept], marks, body.sternum_mm)


def _bare(workshop: Workshop, body: Body, random: np.random.Generator) -> Sighting:
    """The same without bed and scanner: costs little, and shows more people."""
    torso = workshop.torso
    vertices = bent_and_slid(workshop, random, body)[torso.indices]
    skin = smooth_skin(smooth_skin(Surface(vertices, torso.triangles)))
    kept = torso.trunk[cKDTree(vertices).query(skin.vertices)[1]] > TRUNK
    marks = skin.vertices[cKDTree(skin.vertices).query(vertices[workshop.navel_and_nipples])[1]]
    return Sighting(skin.vertices[kept], skin.normals[kept], marks, body.sternum_mm)


def _laid(
    workshop: Workshop, whole: np.ndarray, sternum: float, random: np.random.Generator
) -> tuple[Scene, np.ndarray, np.ndarray]:
    """What the scanner sees, the body (19158, 3) in it, and its navel and nipples (3, 3) on the skin."""
    base, torso = workshop.makehuman.base, workshop.torso
    moment = draw_moment(random, sternum / 150.0)
    navel_below = -float(whole[torso.indices][workshop.navel_and_nipples[0], 1])
    moved = tilted(breathe(torso, whole, sternum, moment.breath_mm), moment)
    level = bed_height(moved, torso) + MATTRESS_GIVES_MM
    raised = raised_bed(level, sternum, moment.raised_deg)
    mattress = bed(level, random, 520.0, -1300.0, 480.0)
    moved = raised.bent(moved)
    skin = smooth_skin(Surface(moved[: base.skin_count], base.triangles))
    marks = skin.vertices[cKDTree(skin.vertices).query(moved[torso.indices][workshop.navel_and_nipples])[1]]
    centre = raised.bent(np.array([0.0, -0.45 * navel_below, level]))
    return Scene(skin, Surface(raised.bent(mattress.vertices), mattress.triangles), centre, navel_below), moved, marks
