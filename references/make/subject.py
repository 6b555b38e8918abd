"""Simulated people to measure against: not in the references, bones drawn under the skin with human spread.

A subject differs from the model in four ways: local modifiers no basis body has, a smooth deformation, nipples
and navel slid over the chest, and bones and areas that follow the anatomy table only up to its spread.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from references.make.anatomy import area_offsets, drop_on_skin, place_areas
from references.make.body import Body, Workshop
from references.make.fields import bump, front_share, random_smooth_field, slide_on_skin
from references.make.makehuman import UNSEEN
from references.make.phenotype import Phenotype
from references.make.posture import Lying


@dataclass(frozen=True)
class Spread:
    """One standard deviation each, in sternum lengths S unless said; derived from the literature, see README."""

    sternum_share: float = 0.08
    bone_level: float = 0.04
    area_level: tuple[float, ...] = (0.03, 0.03, 0.04, 0.08)
    area_across: tuple[float, ...] = (0.03, 0.03, 0.03, 0.06)
    nipple_up: float = 0.075
    """Men and children: 0.85 to 1.15 S below the notch is their whole range."""
    breast_nipple_up: float = 0.13
    """Women after puberty: 0.65 to 1.3 S."""
    nipple_out: float = 0.06
    navel: float = 0.12
    modifiers: int = 7
    modifier_reach: float = 0.5
    smooth_mm: tuple[float, float] = (3.0, 7.0)
    """Smallest and largest root mean square of the smooth deformation, for an adult."""


@dataclass(frozen=True)
class Subject:
    """whole: (19158, 3) mm; landmarks: (5, 3); areas: (4, 3): the truth, on the skin, notch at the origin.

    mesh_bones: (2, 3) and mesh_areas: (4, 3) are where the mesh would carry bones and areas if nothing under the skin
    differed between people: the truth for a registration alone, which can know no more than the skin.
    usual_areas: (2, 4, 3) where the anatomy table puts the areas on the true bones and on mesh_bones: the best guesses
    of somebody who knows the one or the other, whose errors nobody can undercut in the mean.
    """

    phenotype: Phenotype
    whole: np.ndarray
    landmarks: np.ndarray
    areas: np.ndarray
    sternum_mm: float
    mesh_bones: np.ndarray
    mesh_areas: np.ndarray
    usual_areas: np.ndarray


def draw_modifiers(random: np.random.Generator, phenotype: Phenotype, spread: Spread) -> dict[str, float]:
    """A few local modifiers; those of the breast only in women."""
    grown = phenotype.sex == "female" and phenotype.age_years >= 14
    allowed = [name for name in UNSEEN if grown or not name.startswith("breast")]
    chosen = random.choice(len(allowed), spread.modifiers, replace=False)
    return {allowed[place]: float(random.uniform(-1, 1) * spread.modifier_reach) for place in sorted(chosen)}


def draw_subject(
    workshop: Workshop,
    random: np.random.Generator,
    phenotype: Phenotype,
    spread: Spread | None = None,
    lying: Lying | None = None,
) -> Subject:
    """A person of this phenotype with modifiers, deformation and bones of their own. lying: how flesh sinks."""
    spread = spread or Spread()
    phenotype = replace(phenotype, modifiers=draw_modifiers(random, phenotype, spread))
    body = workshop.body(phenotype, lying)
    bent = _bent(random, body, spread)
    carried = _carried(body, bent[workshop.torso.indices])
    whole = _slide_soft_parts(workshop, random, bent, body, spread)
    bones = _draw_bones(random, body.sternum_mm, spread)
    return _with_bones(workshop, random, bones, whole, carried, phenotype, spread)


def bent_and_slid(
    workshop: Workshop, random: np.random.Generator, body: Body, spread: Spread | None = None
) -> np.ndarray:
    """(19158, 3) a body with a smooth deformation, nipples, breasts and navel of its own."""
    spread = spread or Spread()
    return _slide_soft_parts(workshop, random, _bent(random, body, spread), body, spread)


def _bent(random: np.random.Generator, body: Body, spread: Spread) -> np.ndarray:
    size = min(1.0, body.sternum_mm / 150.0)
    amplitude = random.uniform(*spread.smooth_mm) * size
    return body.whole + random_smooth_field(random, body.whole, body.vertices, 120.0 * size, amplitude)


def _carried(body: Body, vertices: np.ndarray) -> np.ndarray:
    """(6, 3) the body's own bones and areas on its bent skin, vertices (n, 3)."""
    marks = (body.landmarks, body.areas)
    places = [np.einsum("kc,kcd->kd", mark.weights, vertices[mark.corners]) for mark in marks]
    return np.concatenate([places[0][:2], places[1]])


def _draw_bones(random: np.random.Generator, expected: float, spread: Spread) -> tuple[float, float]:
    """(height of the notch against where the rig has it, true S), both mm."""
    level = spread.bone_level * expected * random.normal()
    return level, expected * (1 + spread.sternum_share * random.normal())


def _slide_soft_parts(
    workshop: Workshop, random: np.random.Generator, whole: np.ndarray, body: Body, spread: Spread
) -> np.ndarray:
    """Nipples with their breasts, and the navel, move over trunk and belly on their own."""
    indices, triangles, trunk = workshop.torso.indices, workshop.torso.triangles, workshop.torso.trunk
    vertices, landmarks, sternum = whole[indices], body.landmarks.positions, body.sternum_mm
    front = front_share(vertices, triangles) * trunk
    grown = body.phenotype.sex == "female" and body.phenotype.age_years >= 12
    nipple_up = spread.breast_nipple_up if grown else spread.nipple_up
    up, out, navel = random.normal(size=3) * (nipple_up, spread.nipple_out, spread.navel) * sternum
    shift = np.outer(bump(vertices, landmarks[2], 0.4 * sternum), [0.0, navel])
    for place, side in ((3, 1.0), (4, -1.0)):
        shift += np.outer(bump(vertices, landmarks[place], 0.3 * sternum), [side * out, up])
    moved = whole.copy()
    moved[indices] += slide_on_skin(vertices, shift, front, 0.4 * sternum)
    return moved


def _with_bones(
    workshop: Workshop,
    random: np.random.Generator,
    drawn: tuple[float, float],
    whole: np.ndarray,
    carried: np.ndarray,
    phenotype: Phenotype,
    spread: Spread,
) -> Subject:
    level, sternum = drawn
    vertices, trunk = whole[workshop.torso.indices], workshop.trunk_triangles
    midline = 0.5 * (vertices[workshop.navel_and_nipples[1], 0] + vertices[workshop.navel_and_nipples[2], 0])
    notch = np.array([midline, level])
    noise = random.normal(size=(4, 2)) * np.column_stack([spread.area_across, spread.area_level])
    offsets = (area_offsets(phenotype.age_years) + noise) * sternum
    offsets[:2, 0] = [-abs(offsets[0, 0]), abs(offsets[1, 0])]
    places = np.concatenate([[notch, notch - [0.0, sternum]], notch + offsets])
    marks = drop_on_skin(places, vertices, trunk).positions
    soft = vertices[workshop.navel_and_nipples]
    origin = marks[0]
    usual = [place_areas(vertices, trunk, bones, phenotype.age_years).positions for bones in (marks[:2], carried[:2])]
    return Subject(
        phenotype=phenotype,
        whole=whole - origin,
        landmarks=np.concatenate([marks[:2], soft]) - origin,
        areas=marks[2:] - origin,
        sternum_mm=sternum,
        mesh_bones=carried[:2] - origin,
        mesh_areas=carried[2:] - origin,
        usual_areas=np.array(usual) - origin,
    )
