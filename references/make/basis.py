"""The linear model of lying torsos: what build, age and sex do, and what each may do on its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lubdub.fitting.expected import SEXES
from lubdub.geometry.anchors import Anchors
from lubdub.geometry.builds import Builds
from lubdub.geometry.surface import Surface, vertex_normals
from references.make.anatomy import Marks, place_areas
from references.make.body import Body, Workshop
from references.make.fields import (
    along_body,
    area_share,
    bump,
    front_share,
    signs_fixed,
    slide_on_skin,
    smooth_modes,
    smoothstep,
)
from references.make.makehuman import MODELLED
from references.make.phenotype import Phenotype, Sex, draw_phenotype, median_stature
from references.make.posture import draw_lying
from references.make.scan import Stage
from references.make.torso import Torso


@dataclass(frozen=True)
class BasisSettings:
    """Numbers of the model; spreads are one standard deviation, in sternum lengths S where so named."""

    seed: int = 2026
    bodies: int = 800
    children_share: float = 0.4
    modifier_reach: float = 0.5
    build_modes: int = 56
    smooth_shapes: int = 17
    """Times three directions."""
    smooth_mm: float = 6.0
    smooth_reach_mm: float = 120.0
    mean_radius_mm: float = 190.0
    """Root mean square distance of the mean's vertices from their centre: an average adult."""
    sternum_share: float = 0.08
    navel_shift: float = 0.15
    """Navel 2.2 to 2.7 S below the notch."""
    bones_shift: float = 0.08
    """Both bone points together against neck, shoulders and hips."""
    shoulder_shift: float = 0.20
    shoulder_tilt: float = 0.08
    nipple_up: float = 0.14
    """0.65 to 1.3 S below the notch is the whole range."""
    nipple_out: float = 0.08
    nipple_asymmetry: float = 0.03
    nipple_reach: float = 0.30
    arm_turn_deg: float = 12.0


SLIDES = 6
"""Slides are not quite linear on curved skin, and bones and nipples share some of it: after so many, of the marks of 60
bodies 95 in 100 lay right to 0.1 mm, all to 0.5."""


BUILD_AGES = (0.0, 2.0, 5.0, 9.0, 13.0, 17.0, 25.0, 50.0, 85.0)
"""Years, straight between. Seven and twelve such ages told bodies that were left out less well."""


@dataclass(frozen=True)
class Basis:
    """As `lubdub.results.ShapeBasis`, before it is written."""

    mean: np.ndarray
    modes: np.ndarray
    landmarks: Marks
    areas: tuple[Marks, Marks]
    data_weight: np.ndarray
    builds: Builds


def build_basis(workshop: Workshop, settings: BasisSettings | None = None) -> Basis:
    """Draws the training bodies, aligns them, and adds the independent directions. Takes about a minute."""
    settings = settings or BasisSettings()
    average = workshop.body(_average_man())
    marks = average.landmarks
    shared, torso = Anchors(marks.corners, marks.weights), workshop.torso
    drawn = draw_bodies(workshop, settings)
    bodies = np.array([with_marks_in_place(torso, one.vertices, one.landmarks.positions, shared) for one in drawn])
    share = area_share(average.vertices, workshop.torso.triangles)
    mean, aligned = _aligned(bodies, workshop.torso.trunk * share, settings.mean_radius_mm)
    notch = np.einsum("c,cd->d", marks.weights[0], mean[marks.corners[0]])
    mean = mean - notch
    differences = aligned - aligned.mean(0)
    build = _principal_modes(differences, share, settings.build_modes)
    builds = usual_builds([body.phenotype for body in drawn], coefficients_of(differences, build, share))
    own = _own_directions(workshop, mean, marks, settings)
    smooth = smooth_modes(mean, share, settings.smooth_reach_mm, settings.smooth_mm, settings.smooth_shapes)
    landmarks = Marks(np.einsum("kc,kcd->kd", marks.weights, mean[marks.corners]), marks.corners, marks.weights)
    areas = tuple(place_areas(mean, workshop.trunk_triangles, landmarks.positions[:2], age) for age in (30.0, 2.0))
    weight = data_weight(mean, workshop.torso.triangles, workshop.torso.trunk, landmarks)
    return Basis(mean, np.concatenate([build, own, smooth]), landmarks, (areas[0], areas[1]), weight, builds)


def _average_man() -> Phenotype:
    return Phenotype(25.0, "male", median_stature(25.0, "male"))


def draw_bodies(workshop: Workshop, settings: BasisSettings) -> list[Body]:
    """Random people of all ages lying on their backs, breasts sunk more or less; arms all alike."""
    random = np.random.default_rng(settings.seed)
    bodies = []
    for place in range(settings.bodies):
        child = random.random() < settings.children_share
        age = random.uniform(0.0, 16.0) if child else random.uniform(16.0, 85.0)
        sex: Sex = "female" if place % 2 else "male"
        lying = draw_lying(random)
        trunk = {name: random.uniform(-1, 1) * settings.modifier_reach for name in MODELLED}
        bodies.append(workshop.body(replace(draw_phenotype(random, age, sex), modifiers=trunk), lying))
    return bodies


def with_marks_in_place(torso: Torso, vertices: np.ndarray, landmarks: np.ndarray, marks: Anchors) -> np.ndarray:
    """(n, 3) the same skin, its vertices slid so that the shared marks lie on this body's own landmarks.

    vertices: (n, 3), landmarks: (5, 3) of the body; marks: the landmarks of the shared topology.
    """
    front = front_share(vertices, torso.triangles) * torso.trunk
    skin, slid = Stage(Surface(vertices, torso.triangles)), vertices
    for _ in range(SLIDES):
        for shift_to in (_to_bones, _to_nipples):
            moved = slid + slide_on_skin(slid, shift_to(landmarks, marks.on(slid), slid), front)
            slid = np.where(front[:, None] > 0, skin.nearest(moved), vertices)
    return slid


def _to_bones(landmarks: np.ndarray, carried: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(n, 2) shift of whole heights of the body that brings the carried (5, 3) bone points level with its own."""
    notch, xiphoid = landmarks[:2, 1] - carried[:2, 1]
    navel, sternum = landmarks[2, 1], landmarks[0, 1] - landmarks[1, 1]
    levels = (carried[0, 1] + 0.5 * sternum, carried[0, 1], carried[1, 1], navel)
    along = along_body(vertices[:, 1], levels, (0.0, notch, xiphoid, 0.0))
    return np.column_stack([np.zeros_like(along), along])


def _to_nipples(landmarks: np.ndarray, carried: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(n, 2) shift that brings the carried nipples with their surroundings back to the body's own.

    The slide to the bones alone left those of men 7 mm too high, those of women 22.
    """
    reach = BasisSettings.nipple_reach * (landmarks[0, 1] - landmarks[1, 1])
    shifts = [np.outer(bump(vertices, carried[k], reach), (landmarks[k] - carried[k])[:2]) for k in (3, 4)]
    return np.asarray(sum(shifts))


def _aligned(bodies: np.ndarray, weight: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Generalised Procrustes with scale, on the trunk. Returns mean (n, 3) and aligned bodies (b, n, 3)."""
    mean = bodies[0]
    for _ in range(4):
        mean = mean - np.average(mean, axis=0, weights=weight)
        mean = mean * radius / np.sqrt(((mean - mean.mean(0)) ** 2).sum(1).mean())
        aligned = np.array([_onto(body, mean, weight) for body in bodies])
        mean = aligned.mean(0)
    return mean, aligned


def _onto(body: np.ndarray, mean: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Weighted similarity (Umeyama 1991) of a body onto the mean."""
    share = (weight / weight.sum())[:, None]
    start, end = (share * body).sum(0), (share * mean).sum(0)
    a, b = body - start, mean - end
    u, sizes, vt = np.linalg.svd((share * b).T @ a)
    flip = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    scale = (sizes * flip).sum() / (share * a * a).sum()
    return scale * a @ (u * flip @ vt).T + end


def _principal_modes(differences: np.ndarray, share: np.ndarray, count: int) -> np.ndarray:
    """(count, n, 3) principal components, vertices weighted by the skin they stand for."""
    root = np.sqrt(share)[:, None]
    rows = (differences * root).reshape(len(differences), -1)
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    modes = directions[:count] * sizes[:count, None] / np.sqrt(len(rows) - 1)
    modes = modes * signs_fixed(modes)[:, None]
    return modes.reshape(count, -1, 3) / root


def coefficients_of(differences: np.ndarray, modes: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(bodies, k) of orthogonal modes (k, n, 3) in differences (bodies, n, 3), vertices weighted by share (n,)."""
    weighted = (modes * share[:, None]).reshape(len(modes), -1)
    sizes = (weighted * modes.reshape(len(modes), -1)).sum(axis=1)
    return np.asarray(differences.reshape(len(differences), -1) @ weighted.T / sizes)


def usual_builds(people: Sequence[Phenotype], coefficients: np.ndarray) -> Builds:
    """What age and sex let one expect of coefficients (people, b): least squares over straight lines between ages."""
    ages = np.array([person.age_years for person in people])
    near = np.array([np.interp(ages, BUILD_AGES, knot) for knot in np.eye(len(BUILD_AGES))]).T
    rest, means = coefficients.copy(), []
    for sex in SEXES:
        of_sex = np.array([person.sex == sex for person in people])
        means.append(np.linalg.lstsq(near[of_sex], coefficients[of_sex], rcond=None)[0])
        rest[of_sex] -= near[of_sex] @ means[-1]
    free = len(rest) - len(SEXES) * len(BUILD_AGES)
    return Builds(np.array(BUILD_AGES), np.array(means), rest.T @ rest / free)


def _own_directions(workshop: Workshop, mean: np.ndarray, marks: Marks, settings: BasisSettings) -> np.ndarray:
    """(d, n, 3) what skin and bones may do independently of build: `results` of section 9's lesson."""
    landmarks = np.einsum("kc,kcd->kd", marks.weights, mean[marks.corners])
    trunk = workshop.torso.trunk
    front = front_share(mean, workshop.torso.triangles) * trunk
    sternum = -landmarks[1, 1]
    levels = (0.6 * sternum, 0.0, -sternum, landmarks[2, 1], landmarks[2, 1] - 0.8 * sternum)

    def bones(*shifts: float) -> np.ndarray:
        profile = along_body(mean[:, 1], levels, np.array(shifts) * sternum)
        return slide_on_skin(mean, np.column_stack([np.zeros_like(profile), profile]), front)

    directions = [
        bones(0.0, 0.0, -settings.sternum_share, 0.0, 0.0),
        bones(0.0, -settings.bones_shift, -settings.bones_shift, 0.0, 0.0),
        bones(0.0, 0.0, 0.0, -settings.navel_shift, 0.0),
        *_nipple_directions(mean, landmarks, sternum, front, settings),
        *_shoulder_directions(mean, trunk, sternum, settings),
        *_arm_directions(workshop, settings),
    ]
    return np.array(directions)


def _nipple_directions(
    mean: np.ndarray, landmarks: np.ndarray, sternum: float, front: np.ndarray, settings: BasisSettings
) -> list[np.ndarray]:
    left, right = (bump(mean, landmarks[place], settings.nipple_reach * sternum) for place in (3, 4))
    unit_shifts = {
        "up": (np.column_stack([0 * left, left + right]), settings.nipple_up),
        "out": (np.column_stack([left - right, 0 * left]), settings.nipple_out),
        "left higher": (np.column_stack([0 * left, left - right]), settings.nipple_asymmetry),
        "left further out": (np.column_stack([left + right, 0 * left]), settings.nipple_asymmetry),
    }
    ironed = 0.4 * sternum
    return [slide_on_skin(mean, shift * share * sternum, front, ironed) for shift, share in unit_shifts.values()]


def _shoulder_directions(
    mean: np.ndarray, trunk: np.ndarray, sternum: float, settings: BasisSettings
) -> list[np.ndarray]:
    side = np.sign(mean[:, 0])
    up = np.array([0.0, 1.0, 0.0])
    rise = (1.0 - trunk)[:, None] * up
    return [rise * settings.shoulder_shift * sternum, rise * side[:, None] * settings.shoulder_tilt * sternum]


def _arm_directions(workshop: Workshop, settings: BasisSettings) -> list[np.ndarray]:
    man, turn = _average_man(), settings.arm_turn_deg
    directions = []
    for left, right in ((turn, 0.0), (0.0, turn)):
        lower, higher = (
            workshop.body(Phenotype(man.age_years, man.sex, man.stature_mm, arms_deg=(35 + s * left, 35 + s * right)))
            for s in (1, -1)
        )
        directions.append((lower.vertices - higher.vertices) / 2)
    return directions


NECK_SAYS = 0.5
"""Weight of the neck's front and the shoulders' inner part: they fix the notch better than the chest does, but heads
lie turned and bent. With 0, 0.3, 0.5 and 1 the notch of a real woman from CT was 30, 14, 10 and 24 mm off."""


def data_weight(mean: np.ndarray, triangles: np.ndarray, trunk: np.ndarray, landmarks: Marks) -> np.ndarray:
    """(n,) how much skin there says: 1 on the trunk's front and flanks, half on the neck, 0 on arms and back.

    Where vertices are dense, above all around the nipples, each counts for the little skin it stands for.
    """
    sternum = -landmarks.positions[1, 1]
    normals = vertex_normals(mean, triangles)
    facing = smoothstep(normals[:, 2], -0.7, -0.2)
    below_neck = 1.0 - smoothstep(mean[:, 1], 0.15 * sternum, 0.45 * sternum)
    weight = smoothstep(trunk, 0.3, 0.95) * facing * below_neck * area_share(mean, triangles)
    neck = (mean[:, 1] > 0) & (np.abs(mean[:, 0]) < 1.35 * sternum) & (normals[:, 2] > -0.3)
    return np.where(neck, np.maximum(weight, NECK_SAYS), weight)
