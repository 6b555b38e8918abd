"""From MakeHuman's standing body to one that lies on its back with the arms a little out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.sparse import csr_matrix

from lubdub.geometry.surface import edges_of
from references.make.makehuman import MakeHuman
from references.make.phenotype import Phenotype
from references.make.torso import Torso, joint

NIPPLE_LEFT, NIPPLE_RIGHT, NAVEL = 8451, 1779, 4116
"""Vertices of the base mesh, from its targets `breast/nipple-point-*` and `stomach/stomach-navel-*`."""

FLAT_CUP, FLAT_FIRMNESS = 0.0, 0.5


@dataclass(frozen=True)
class Lying:
    """How strongly lying changes a standing shape; every number our own judgement of pictures of supine people."""

    back_softness_mm: float = 7.0
    back_pressed: float = 0.13
    """Share of the trunk's depth by which the bed flattens the shoulder blades and buttocks."""
    belly_sinks: float = 0.05
    """Share of its depth that a belly of average weight loses; twice that in the heaviest."""
    breast_flattens: float = 0.68
    breast_droop_lost: float = 0.8
    """Share of the standing breast's hanging that is gone."""
    breast_slides_up: float = 0.30
    breast_slides_out: float = 0.25
    """Nipple's way along the chest, in thicknesses of the breast; firm breasts two thirds as far."""
    elbow_above_bed_mm: float = 45.0
    wrist_above_bed_mm: float = 32.0
    """Middle of the joint in a person of 1,750 mm."""
    girdle_share: float = 0.25
    """Share of the arm's turn that collar bone and shoulder blade follow."""


def draw_lying(random: np.random.Generator) -> Lying:
    """How one person's flesh sinks: as differently as people's do, by the same judgement."""
    return Lying(
        back_pressed=random.uniform(0.06, 0.18),
        belly_sinks=random.uniform(0.0, 0.12),
        breast_flattens=random.uniform(0.35, 0.8),
        breast_slides_up=random.uniform(0.05, 0.5),
        breast_slides_out=random.uniform(0.05, 0.5),
    )


def lie_down(makehuman: MakeHuman, torso: Torso, phenotype: Phenotype, lying: Lying | None = None) -> np.ndarray:
    """(19158, 3) mm: this person on the back, in MakeHuman's axes (+x patient's left, +y head, +z front)."""
    lying = lying or Lying()
    vertices = _lower_arms(makehuman.shape(phenotype), makehuman, torso, phenotype, lying)
    if phenotype.sex == "female" and phenotype.age_years >= 10:
        vertices = _relax_breasts(vertices, makehuman, torso, phenotype, lying)
    vertices = _rest_arms(vertices, torso, phenotype, lying)
    vertices = _sink_belly(vertices, torso, phenotype, lying)
    return _press_back(vertices, torso, lying)


def bed_height(vertices: np.ndarray, torso: Torso) -> float:
    """z of the bed under a lying body."""
    trunk = torso.indices[torso.trunk > 0.5]
    return float(np.percentile(vertices[trunk, 2], 0.5))


def _turn_z(angle_deg: float) -> np.ndarray:
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _lower_arms(
    vertices: np.ndarray, makehuman: MakeHuman, torso: Torso, phenotype: Phenotype, lying: Lying
) -> np.ndarray:
    moved = vertices.copy()
    for side, sign, degrees in (("L", -1, phenotype.arms_deg[0]), ("R", 1, phenotype.arms_deg[1])):
        shoulder = joint(vertices, makehuman.base, f"{side.lower()}-shoulder")
        clavicle = joint(vertices, makehuman.base, f"{side.lower()}-clavicle")
        girdle_turn = _turn_z(sign * degrees * lying.girdle_share)
        girdle = (vertices - clavicle) @ girdle_turn.T + clavicle
        new_shoulder = girdle_turn @ (shoulder - clavicle) + clavicle
        arm = (vertices - shoulder) @ _turn_z(sign * degrees).T + new_shoulder
        moved += torso.girdle_weights[side][:, None] * (girdle - vertices)
        moved += torso.arm_weights[side][:, None] * (arm - vertices)
    return moved


def _rest_arms(vertices: np.ndarray, torso: Torso, phenotype: Phenotype, lying: Lying) -> np.ndarray:
    """MakeHuman carries its forearms in front; on a bed they rest on it. The arms run along the body by now."""
    size = phenotype.stature_mm / 1750.0
    bed = _bed_plane(vertices, torso, lying)
    moved = vertices.copy()
    for side in "LR":
        arm, forearm, hand = torso.arm_weights[side], torso.forearm_weights[side], torso.hand_weights[side]
        shoulder = vertices[(arm > 0.3) & (arm < 0.7)].mean(0)
        elbow = vertices[(forearm > 0.3) & (forearm < 0.7)].mean(0)
        wrist = vertices[(hand > 0.3) & (hand < 0.7)].mean(0)
        falls = (
            0.0,
            max(0.0, elbow[2] - bed - size * lying.elbow_above_bed_mm),
            max(0.0, wrist[2] - bed - size * lying.wrist_above_bed_mm),
        )
        levels = (wrist[1], elbow[1], shoulder[1])
        moved[:, 2] -= arm * np.interp(vertices[:, 1], levels, falls[::-1])
    return moved


@dataclass(frozen=True)
class _Breasts:
    """flat: (19158, 3) the same woman without; thickness: (19158, 3) what they add; height: of the flat chest."""

    flat: np.ndarray
    thickness: np.ndarray
    height: LinearNDInterpolator


def _relax_breasts(
    vertices: np.ndarray, makehuman: MakeHuman, torso: Torso, phenotype: Phenotype, lying: Lying
) -> np.ndarray:
    """Flattens the breasts and slides them up and outwards over the chest, as gravity does."""
    kept = {name: value for name, value in phenotype.modifiers.items() if not name.startswith("breast/")}
    bare = replace(phenotype, cup=FLAT_CUP, firmness=FLAT_FIRMNESS, modifiers=kept)
    flat = _lower_arms(makehuman.shape(bare), makehuman, torso, bare, lying)
    # The median removes the shift between the two: apart from the breasts they are one body.
    flat = flat + np.median((vertices - flat)[torso.indices], axis=0)
    breasts = _Breasts(flat, vertices - flat, _front_height(flat, torso))
    moved = vertices + _slide_breast(breasts, NIPPLE_LEFT, phenotype, lying)
    moved += _slide_breast(breasts, NIPPLE_RIGHT, phenotype, lying)
    size = np.linalg.norm(breasts.thickness, axis=1)
    return _softened(moved, makehuman, np.clip(size / max(size[NIPPLE_LEFT], 25.0), 0, 1))


def _front_height(flat: np.ndarray, torso: Torso) -> LinearNDInterpolator:
    trunk = torso.indices[torso.trunk > 0.3]
    middle = np.median(flat[trunk, 2])
    front = flat[trunk[flat[trunk, 2] > middle]]
    return LinearNDInterpolator(front[:, :2], front[:, 2])


def _slide_breast(breasts: _Breasts, nipple: int, phenotype: Phenotype, lying: Lying) -> np.ndarray:
    """(19158, 3) displacement of the breast of one nipple."""
    flat, side = breasts.flat, np.sign(breasts.flat[nipple, 0])
    thickness = max(0.0, float(breasts.thickness[nipple, 2]))
    loose = 1.0 - 0.35 * phenotype.firmness
    reach = 70.0 * phenotype.stature_mm / 1635.0 + 0.5 * thickness
    near = np.exp(-0.5 * ((flat[:, :2] - flat[nipple, :2]) ** 2).sum(1) / reach**2)
    own = (flat[:, 0] * side > 0) * np.clip(np.abs(flat[:, 0]) / 25.0, 0, 1)
    slide = (near * own)[:, None] * thickness * loose * [side * lying.breast_slides_out, lying.breast_slides_up]
    rise = breasts.height(flat[:, :2] + slide) - breasts.height(flat[:, :2])
    rise = np.where(np.isfinite(rise), rise, 0.0)
    share_lost = np.array([0.0, lying.breast_droop_lost, lying.breast_flattens * loose])
    lost = (flat[:, 0] * side > 0)[:, None] * breasts.thickness * share_lost
    return np.column_stack([slide, rise]) - lost


def _softened(vertices: np.ndarray, makehuman: MakeHuman, share: np.ndarray) -> np.ndarray:
    """Creases left where a breast hung or was moved are ironed by Laplacian smoothing, most where share is 1."""
    edges = edges_of(makehuman.base.triangles)
    both = np.concatenate([edges, edges[:, ::-1]])
    count = len(vertices)
    graph = csr_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(count, count))
    neighbours = np.maximum(np.asarray(graph.sum(axis=1)).ravel(), 1.0)[:, None]
    skin = (np.arange(count) < makehuman.base.skin_count) * 0.6 * share
    for _ in range(6):
        vertices = vertices + skin[:, None] * (graph @ vertices / neighbours - vertices)
    return vertices


def _sink_belly(vertices: np.ndarray, torso: Torso, phenotype: Phenotype, lying: Lying) -> np.ndarray:
    """Belly fat sinks towards the bed and spreads to the flanks."""
    bed = bed_height(vertices, torso)
    navel, nipple = vertices[NAVEL, 1], vertices[NIPPLE_LEFT, 1]
    reach = 0.45 * (nipple - navel)
    along = np.exp(-0.5 * ((vertices[:, 1] - navel) / reach) ** 2)
    limbs = sum(torso.arm_weights.values())
    sink = lying.belly_sinks * 2 * phenotype.weight * along * (1 - np.clip(limbs, 0, 1))
    depth = np.clip(vertices[:, 2] - bed, 0, None)
    moved = vertices.copy()
    moved[:, 2] -= sink * depth * np.clip(depth / max(depth[NAVEL], 1.0), 0, 1.2)
    moved[:, 0] *= 1 + 0.5 * sink
    return moved


def _press_back(vertices: np.ndarray, torso: Torso, lying: Lying) -> np.ndarray:
    """A soft bed: everything behind its plane is pressed to it, smoothly."""
    depth = np.ptp(vertices[torso.indices[torso.trunk > 0.5], 2])
    bed = _bed_plane(vertices, torso, lying)
    softness = lying.back_softness_mm * depth / 240.0
    moved = vertices.copy()
    moved[:, 2] = bed + softness * np.logaddexp(0.0, (vertices[:, 2] - bed) / softness)
    return moved


def _bed_plane(vertices: np.ndarray, torso: Torso, lying: Lying) -> float:
    trunk = vertices[torso.indices[torso.trunk > 0.5]]
    return float(trunk[:, 2].min() + lying.back_pressed * np.ptp(trunk[:, 2]))
