"""The part of the base mesh that every reference shares: neck base to hips, with the upper arms' near part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from lubdub.geometry.surface import edges_of
from references.make.makehuman import MM_PER_DECIMETRE, BaseMesh, MakeHuman

NECK_ABOVE_JOINT_MM = 25.0
HIP_BELOW_JOINT_MM = 10.0
ARM_KEPT = 0.65
"""Of the upper arm, from the shoulder joint to the elbow."""


@dataclass(frozen=True)
class Torso:
    """The shared topology. indices: (n,) into the base mesh; triangles: (m, 3) into indices.

    trunk: (n,) 1 on the trunk, 0 on arms and shoulders; the weights are side -> (19158,), the shares by which
    the arm, the shoulder girdle, the forearm and the hand move each vertex.
    """

    indices: np.ndarray
    triangles: np.ndarray
    trunk: np.ndarray
    arm_weights: dict[str, np.ndarray]
    girdle_weights: dict[str, np.ndarray]
    forearm_weights: dict[str, np.ndarray]
    hand_weights: dict[str, np.ndarray]


def cut_torso(makehuman: MakeHuman) -> Torso:
    """Cuts the shared topology out of the base mesh and measures what moves with arms and shoulders."""
    base = makehuman.base
    arms = {side: makehuman.skin_weight(f"upperarm01.{side}") for side in "LR"}
    girdles = {side: makehuman.bone_weight(f"shoulder01.{side}", f"clavicle.{side}") for side in "LR"}
    forearms = {side: makehuman.skin_weight(f"lowerarm01.{side}") for side in "LR"}
    hands = {side: makehuman.skin_weight(f"wrist.{side}") for side in "LR"}
    keep = _kept(base, arms, forearms["L"] + forearms["R"])
    triangles = base.triangles[keep[base.triangles].all(axis=1)]
    indices, local = np.unique(_largest_piece(triangles), return_inverse=True)
    limbs = sum(arms.values()) + sum(girdles.values())
    trunk = 1.0 - np.clip(limbs[indices], 0.0, 1.0)
    return Torso(indices, local.reshape(-1, 3), trunk, arms, girdles, forearms, hands)


def joint(vertices: np.ndarray, base: BaseMesh, name: str) -> np.ndarray:
    """(3,) where a joint of the rig lies in a body of the base mesh."""
    return np.asarray(vertices[base.joints[name]].mean(axis=0))


def _kept(base: BaseMesh, arms: dict[str, np.ndarray], forearms: np.ndarray) -> np.ndarray:
    vertices = base.vertices * MM_PER_DECIMETRE
    skin = np.arange(base.skin_count)
    top = joint(vertices, base, "neck")[1] + NECK_ABOVE_JOINT_MM
    bottom = joint(vertices, base, "l-upper-leg")[1] - HIP_BELOW_JOINT_MM
    keep = (vertices[skin, 1] < top) & (vertices[skin, 1] > bottom) & (forearms[skin] < 0.5)
    for side in "LR":
        shoulder = joint(vertices, base, f"{side.lower()}-shoulder")
        arm = joint(vertices, base, f"{side.lower()}-elbow") - shoulder
        along = (vertices[skin] - shoulder) @ arm / (arm @ arm)
        keep &= ~((arms[side][skin] > 0.5) & (along > ARM_KEPT))
    return keep


def _largest_piece(triangles: np.ndarray) -> np.ndarray:
    edges, size = edges_of(triangles), triangles.max() + 1
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(size, size))
    labels = connected_components(graph, directed=False)[1]
    biggest = np.bincount(labels[triangles[:, 0]]).argmax()
    return triangles[labels[triangles[:, 0]] == biggest]
