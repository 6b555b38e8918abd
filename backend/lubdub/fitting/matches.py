"""Which point of the scan each vertex of the source belongs to, and whether to believe it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True)
class Target:
    """The scan to be matched. points, normals: (n, 3); is_border: (n,) bool, True on the scan's rim."""

    points: np.ndarray
    normals: np.ndarray
    is_border: np.ndarray


@dataclass(frozen=True)
class MatchRules:
    """When a nearest point counts. farthest: in the target's unit."""

    farthest: float
    widest_angle_deg: float
    skip_border: bool


@dataclass(frozen=True)
class Matches:
    """points: (v, 3) the nearest target point of each vertex. trusted: (v,) bool, the weight w of eq. 3.

    covered: (v,) bool, False for vertices that lie beyond the scan's rim and cannot be matched by anyone.
    """

    points: np.ndarray
    trusted: np.ndarray
    covered: np.ndarray

    def share(self) -> float:
        """How much of the covered source is trusted, 0 to 1."""
        return float(self.trusted.sum() / max(1, self.covered.sum()))


class Matcher:
    """Finds matches on one target again and again."""

    def __init__(self, target: Target, rules: MatchRules) -> None:
        self._target = target
        self._rules = rules
        self._tree = cKDTree(target.points)
        self._least_cosine = float(np.cos(np.deg2rad(rules.widest_angle_deg)))

    def match(self, vertices: np.ndarray, normals: np.ndarray) -> Matches:
        """The nearest target point of each vertex (v, 3), trusted by distance, angle and rim."""
        distance, nearest = self._tree.query(vertices)
        on_rim = self._target.is_border[nearest]
        cosine = (normals * self._target.normals[nearest]).sum(axis=1)
        trusted = (distance < self._rules.farthest) & (cosine > self._least_cosine)
        if self._rules.skip_border:
            trusted &= ~on_rim
        return Matches(self._target.points[nearest], trusted, ~on_rim)
