"""The paper's non-rigid ICP: its Algorithm 1, after Amberg et al., Optimal step nonrigid ICP, CVPR 2007."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lubdub.fitting.matches import Matcher, Matches, MatchRules, Target
from lubdub.fitting.schedule import PaperSettings
from lubdub.fitting.solve import AffineStep
from lubdub.geometry.sparse import SolverName
from lubdub.geometry.surface import Surface, vertex_normals


class NothingMatches(ArithmeticError):
    """Source and target do not lie on each other: too few matches to bend anything."""


@dataclass(frozen=True)
class BendStep:
    """The source after one solve. vertices: (n, 3) mm; matches: those that led here, also in mm."""

    alpha: float
    iteration: int
    change_mm: float
    matched_share: float
    vertices: np.ndarray
    matches: Matches

    def numbers(self) -> dict[str, float]:
        """What is kept of this step in a result."""
        return {
            "alpha": self.alpha,
            "iteration": float(self.iteration),
            "change_mm": self.change_mm,
            "matched_share": self.matched_share,
        }


@dataclass(frozen=True)
class WorkingScale:
    """The frame the equations are solved in: origin at the source's centre, its box's diagonal 1.

    A map's 3 x 3 part has no unit but its translation has one, and eq. 4 adds the two up, so the unit
    decides how stiff the source is. With a diagonal of 1 the paper's alphas mean what they mean in
    Amberg's work; in plain millimetres the error was a quarter larger and the time double. Centred,
    because the translation that eq. 4 penalises is that of the origin.
    """

    centre: np.ndarray
    per_mm: float

    @staticmethod
    def of(vertices: np.ndarray) -> WorkingScale:
        """The working scale of a source (n, 3)."""
        return WorkingScale(vertices.mean(axis=0), float(1 / np.linalg.norm(np.ptp(vertices, axis=0))))

    def enter(self, points: np.ndarray) -> np.ndarray:
        """From millimetres."""
        return np.asarray((points - self.centre) * self.per_mm)

    def leave(self, points: np.ndarray) -> np.ndarray:
        """Back to millimetres."""
        return np.asarray(points / self.per_mm + self.centre)


@dataclass(frozen=True)
class MarkPairs:
    """Landmarks by pairs. on_source, on_target: (k, 3) mm; k may be 0."""

    on_source: np.ndarray
    on_target: np.ndarray


def bend(
    source: Surface,
    target: Target,
    marks: MarkPairs,
    settings: PaperSettings,
    solver: SolverName | None = None,
) -> Iterator[BendStep]:
    """Bend the source onto the target, softer and softer; yields the state after every solve.

    All in millimetres, the source already overlaid on the target. The last step is the answer.
    Raises NothingMatches when fewer than `settings.fewest_matches` vertices find the target.
    """
    scale = WorkingScale.of(source.vertices)
    inner = Target(scale.enter(target.points), target.normals, target.is_border)
    rules = MatchRules(settings.farthest_match, settings.widest_angle_deg, settings.skip_border)
    matcher = Matcher(inner, rules)
    vertices = scale.enter(source.vertices)
    step = AffineStep(vertices, source.triangles, scale.enter(marks.on_source), settings.gamma, solver)
    mark_targets = scale.enter(marks.on_target)
    for alpha, beta in settings.steps():
        for iteration in range(settings.most_repeats):
            matches = matcher.match(vertices, vertex_normals(vertices, source.triangles))
            if matches.trusted.sum() < settings.fewest_matches:
                raise NothingMatches("the reference and the scan do not lie on each other")
            moved = step.deformed(step.solve(matches, mark_targets, alpha, beta))
            change_mm = float(np.linalg.norm(moved - vertices, axis=1).mean() / scale.per_mm)
            vertices = moved
            in_mm = Matches(scale.leave(matches.points), matches.trusted, matches.covered)
            yield BendStep(alpha, iteration, change_mm, matches.share(), scale.leave(vertices), in_mm)
            if change_mm < settings.acceptable_change_mm:
                break
