"""MakeHuman's CC0 base mesh, its shape targets and skin weights, read with numpy alone."""

from __future__ import annotations

import gzip
import json
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from references.make.phenotype import Phenotype

MM_PER_DECIMETRE = 100.0

Shares = dict[str, float]


@dataclass(frozen=True)
class BaseMesh:
    """The undeformed mesh. vertices: (19158, 3) dm; triangles: (m, 3) of the skin; joints: name -> indices."""

    vertices: np.ndarray
    triangles: np.ndarray
    joints: dict[str, np.ndarray]

    @property
    def skin_count(self) -> int:
        """The first so many vertices are skin; clothes helpers and joint cubes follow."""
        return int(self.triangles.max()) + 1


class MakeHuman:
    """Makes bodies from a `Phenotype`. folder: the unpacked `mpfb2` folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.base = _read_obj(folder / "3dobjs" / "base.obj")
        self._target = lru_cache(maxsize=None)(self._read_target)

    def shape(self, phenotype: Phenotype) -> np.ndarray:
        """(19158, 3) vertices in mm of the standing body with its arms half raised, at its full stature."""
        vertices = self.base.vertices.copy()
        for name, weight in _recipe(phenotype).items():
            self._add(vertices, name, weight)
        standing = vertices * MM_PER_DECIMETRE
        height = np.ptp(standing[: self.base.skin_count, 1])
        return standing * (phenotype.stature_mm / height)

    def skin_weight(self, *roots: str) -> np.ndarray:
        """(19158,) how much the named bones and all bones below them move each vertex, 0 to 1."""
        total = np.zeros(len(self.base.vertices))
        for bone in self._bones_below(set(roots)):
            for index, weight in self._weights.get(bone, []):
                total[int(index)] += weight
        return total

    def bone_weight(self, *bones: str) -> np.ndarray:
        """(19158,) how much exactly these bones move each vertex."""
        total = np.zeros(len(self.base.vertices))
        for bone in bones:
            for index, weight in self._weights.get(bone, []):
                total[int(index)] += weight
        return total

    def _add(self, vertices: np.ndarray, name: str, weight: float) -> None:
        if abs(weight) < 1e-6:
            return
        indices, offsets = self._target(name)
        vertices[indices] += weight * offsets

    def _read_target(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Vertex indices and their (k, 3) offsets; empty when MakeHuman has no such target (no effect)."""
        path = self._folder / "targets" / f"{name}.target.gz"
        if not path.exists():
            return np.zeros(0, np.int64), np.zeros((0, 3))
        with gzip.open(path, "rt") as file:
            rows = [line.split()[:4] for line in file if line.strip() and not line.startswith("#")]
        table = np.array(rows, np.float64).reshape(-1, 4)
        return table[:, 0].astype(np.int64), table[:, 1:]

    @cached_property
    def _weights(self) -> dict[str, list[tuple[int, float]]]:
        table = json.loads((self._folder / "rigs" / "standard" / "weights.default.json").read_text())
        return table.get("weights", table)

    def _bones_below(self, found: set[str]) -> list[str]:
        rig = json.loads((self._folder / "rigs" / "standard" / "rig.default.json").read_text())
        while True:
            more = {name for name, bone in rig.items() if isinstance(bone, dict) and bone.get("parent") in found}
            if more <= found:
                return sorted(found)
            found = found | more


def _read_obj(path: Path) -> BaseMesh:
    vertices, groups, group = [], {}, ""
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(value) for value in rest[:3]])
        elif word == "g":
            group = rest[0]
        elif word == "f":
            groups.setdefault(group, []).append([int(corner.split("/")[0]) - 1 for corner in rest])
    joints = {
        name.removeprefix("joint-"): np.unique(np.concatenate(faces))
        for name, faces in groups.items()
        if name.startswith("joint-")
    }
    return BaseMesh(np.array(vertices), _triangulated(groups["body"]), joints)


def _triangulated(faces: list[list[int]]) -> np.ndarray:
    triangles = []
    for face in faces:
        triangles.append(face[:3])
        if len(face) == 4:
            triangles.append([face[0], face[2], face[3]])
    return np.array(triangles, np.int64)


def _recipe(phenotype: Phenotype) -> Shares:
    """Target name -> weight: MakeHuman's products of piecewise-linear shares, then the local modifiers."""
    total: Shares = {}
    sex, ages = phenotype.sex, _age_shares(phenotype.makehuman_age)
    muscles = _three(phenotype.muscle, "minmuscle", "averagemuscle", "maxmuscle")
    weights = _three(phenotype.weight, "minweight", "averageweight", "maxweight")
    for (ancestry, part), (age, share) in product(phenotype.ancestry.items(), ages.items()):
        total[f"macrodetails/{ancestry}-{sex}-{age}"] = part * share
    for (age, a), (muscle, m), (weight, w) in product(ages.items(), muscles.items(), weights.items()):
        build, share = f"{sex}-{age}-{muscle}-{weight}", a * m * w
        if share == 0.0:
            continue
        total[f"macrodetails/universal-{build}"] = share
        for kind, part in _extras(phenotype, build).items():
            total[kind] = part * share
    for name, value in phenotype.modifiers.items():
        total[modifier_target(name, value)] = abs(value)
    return total


def _extras(phenotype: Phenotype, build: str) -> Shares:
    heights = _three(phenotype.height, "minheight", "", "maxheight")
    ideals = _three(phenotype.proportions, "uncommonproportions", "", "idealproportions")
    extras = {f"macrodetails/height/{build}-{kind}": share for kind, share in heights.items() if kind}
    extras |= {f"macrodetails/proportions/{build}-{kind}": share for kind, share in ideals.items() if kind}
    if phenotype.sex == "female":
        cups = _three(phenotype.cup, "mincup", "averagecup", "maxcup")
        firmnesses = _three(phenotype.firmness, "minfirmness", "averagefirmness", "maxfirmness")
        for (cup, c), (firmness, f) in product(cups.items(), firmnesses.items()):
            extras[f"breast/{build}-{cup}-{firmness}"] = c * f
    return extras


def _three(value: float, low: str, middle: str, high: str) -> Shares:
    return {low: max(0.0, 1 - 2 * value), middle: 1 - abs(2 * value - 1), high: max(0.0, 2 * value - 1)}


def _age_shares(age: float) -> Shares:
    """MakeHuman's anchors baby 0, child 0.1875, young 0.5, old 1; younger than baby is extrapolated."""
    anchors = (("baby", 0.0), ("child", 0.1875), ("young", 0.5), ("old", 1.0))
    for (low, start), (high, end) in pairwise(anchors):
        if age < end or high == "old":
            share = (age - start) / (end - start)
            return {low: 1 - share, high: share}
    raise AssertionError("the last anchor catches every age")


def modifier_target(name: str, value: float) -> str:
    """The target's file for a local modifier such as `torso/torso-scale-depth`, by the sign of its value."""
    low, high = ("down", "up") if name.split("/")[1] in UP_AND_DOWN else ("decr", "incr")
    return f"{name}-{high if value > 0 else low}"


UP_AND_DOWN = {"breast-trans", "breast-volume-vert", "stomach-navel", "hip-waist"}
MODELLED = ("torso/measure-waist-circ", "torso/torso-scale-depth", "torso/torso-scale-horiz")
"""Local modifiers that the basis knows: bellies and barrel chests go beyond MakeHuman's weight."""

UNSEEN = (
    *(f"torso/measure-{part}" for part in ("bust-circ", "frontchest-dist", "hips-circ", "napetowaist-dist")),
    *(f"torso/measure-{part}" for part in ("shoulder-dist", "underbust-circ", "waisttohip-dist")),
    *(f"torso/torso-{part}" for part in ("muscle-dorsi", "muscle-pectoral", "scale-vert", "vshape")),
    *("stomach/stomach-tone", "stomach/stomach-navel", "pelvis/bulge", "pelvis/pelvis-tone"),
    *("hip/hip-scale-depth", "hip/hip-scale-horiz", "hip/hip-scale-vert", "hip/hip-waist"),
    *("breast/breast-dist", "breast/breast-point", "breast/breast-trans", "breast/breast-volume-vert"),
)
"""Local modifiers that no reference and no basis body has: with them simulated people differ from the model."""
