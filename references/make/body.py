"""One lying body with its bones, navel, nipples and areas, in the body frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from references.make.anatomy import (
    NOTCH_BELOW_CLAVICLE_JOINT,
    Marks,
    drop_on_skin,
    place_areas,
    place_bones,
    sternum_mm,
)
from references.make.fields import bump, front_share, slide_on_skin
from references.make.makehuman import MakeHuman
from references.make.phenotype import Phenotype, median_stature
from references.make.posture import NAVEL, NIPPLE_LEFT, NIPPLE_RIGHT, Lying, lie_down
from references.make.torso import cut_torso, joint
from references.make.wheel import makehuman_folder

PUBERTY_YEARS = 12.0
NIPPLES_OF_BREADTH = 0.62
"""Distance between the nipples: 60 +- 4 % of the thorax's breadth (100 men, doi 10.7759/cureus.89137); no less in
children, whose share of the circumference is rather larger (Faridi 2013)."""
NIPPLES_BELOW_NOTCH = 0.80
"""Children's nipples lie as men's, over the 4th space: at least this many sternum lengths below the notch."""


@dataclass(frozen=True)
class Body:
    """whole: (19158, 3) all of the person; vertices: (n, 3) the shared torso; both mm, body frame.

    landmarks: five Marks in the order of LANDMARK_NAMES; areas: four in the order of AREA_NAMES.
    """

    phenotype: Phenotype
    whole: np.ndarray
    vertices: np.ndarray
    landmarks: Marks
    areas: Marks
    sternum_mm: float


class Workshop:
    """What every step of the build needs: MakeHuman and the shared topology."""

    def __init__(self) -> None:
        self.makehuman = MakeHuman(makehuman_folder())
        self.torso = cut_torso(self.makehuman)
        order = {int(vertex): place for place, vertex in enumerate(self.torso.indices)}
        self.navel_and_nipples = np.array([order[vertex] for vertex in (NAVEL, NIPPLE_LEFT, NIPPLE_RIGHT)])
        self.notch = self._mark_notch()

    def _mark_notch(self) -> Marks:
        """The suprasternal notch on the shared skin, from the rig of the average man."""
        man = Phenotype(25.0, "male", median_stature(25.0, "male"))
        whole = lie_down(self.makehuman, self.torso, man)
        joint_y = joint(whole, self.makehuman.base, "l-clavicle")[1]
        place = np.array([[0.0, joint_y - NOTCH_BELOW_CLAVICLE_JOINT * man.stature_mm]])
        return drop_on_skin(place, whole[self.torso.indices], self.trunk_triangles)

    def body(self, phenotype: Phenotype, lying: Lying | None = None) -> Body:
        """Builds, lays down, marks, and puts the notch at the origin."""
        whole = lie_down(self.makehuman, self.torso, phenotype, lying)
        sternum = sternum_mm(phenotype.age_years, phenotype.sex, phenotype.stature_mm)
        if phenotype.age_years < PUBERTY_YEARS:
            whole = self._with_childs_nipples(whole, sternum)
        trunk = self.trunk_triangles
        vertices = whole[self.torso.indices]
        bones = place_bones(vertices, trunk, self.notch, sternum)
        origin = bones.positions[0]
        whole, vertices = whole - origin, vertices - origin
        landmarks = self.mark_landmarks(vertices, bones)
        areas = place_areas(vertices, trunk, landmarks.positions[:2], phenotype.age_years)
        return Body(phenotype, whole, vertices, landmarks, areas, sternum)

    def _with_childs_nipples(self, whole: np.ndarray, sternum: float) -> np.ndarray:
        """MakeHuman's babies have nipples too far in and up: slides them over the chest to where they belong."""
        vertices = whole[self.torso.indices]
        left, right = vertices[self.navel_and_nipples[1:]]
        notch = float(self.notch.weights[0] @ vertices[self.notch.corners[0], 1])
        out = max(0.0, NIPPLES_OF_BREADTH / 2 * self._breadth(vertices, left[1]) - left[0])
        down = max(0.0, NIPPLES_BELOW_NOTCH * sternum - (notch - left[1]))
        front = front_share(vertices, self.torso.triangles) * self.torso.trunk
        reach = 0.45 * sternum
        shift = np.outer(bump(vertices, left, reach), [out, -down])
        shift += np.outer(bump(vertices, right, reach), [-out, -down])
        moved = whole.copy()
        moved[self.torso.indices] += slide_on_skin(vertices, shift, front, 0.3 * sternum)
        return moved

    def _breadth(self, vertices: np.ndarray, level: float) -> float:
        """Of the trunk without arms, at a height."""
        near = (np.abs(vertices[:, 1] - level) < 0.06 * np.ptp(vertices[:, 1])) & (self.torso.trunk > 0.9)
        return float(np.ptp(vertices[near, 0]))

    @property
    def trunk_triangles(self) -> np.ndarray:
        """(k, 3) the triangles that can carry a mark: no arms."""
        return self.torso.triangles[(self.torso.trunk[self.torso.triangles] > 0.05).any(axis=1)]

    def mark_landmarks(self, vertices: np.ndarray, bones: Marks) -> Marks:
        """The two bone points as placed, then navel and nipples, which are vertices of the topology."""
        corners = np.concatenate([bones.corners, np.repeat(self.navel_and_nipples[:, None], 3, axis=1)])
        weights = np.concatenate([bones.weights, np.tile([1.0, 0.0, 0.0], (3, 1))])
        return Marks(np.einsum("kc,kcd->kd", weights, vertices[corners]), corners, weights)
