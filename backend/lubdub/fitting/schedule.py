"""The numbers of the paper's non-rigid ICP, in one place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from lubdub.results import LandmarkName


@dataclass(frozen=True)
class PaperSettings:
    """How a reference is bent onto a scan, as in the paper's Methods and in Amberg et al., CVPR 2007.

    About stiffness and landmark weights: Amberg stacks the weighted terms as rows of one matrix, so the
    energy that is minimised carries alpha^2 and beta^2, where the paper's eq. 2 prints them plain. The
    paper follows Amberg's algorithm and its numbers are the ones used with stacked rows elsewhere
    (menpo3d), so they enter squared here too.
    """

    stiffness: tuple[float, ...] = (50, 20, 5, 2, 0.8, 0.5, 0.35, 0.3, 0.2)
    """alpha of eq. 2, from stiff to soft (the paper's list)."""
    landmark_weights: tuple[float, ...] = (5, 2, 0.5)
    """beta of eq. 2 for the first steps (the paper's list)."""
    last_landmark_weight: float = 0.0
    """beta once that list is used up. The paper does not say; menpo3d, where the list comes from, goes on
    with 0. Holding 0.5 instead made no measurable difference: a few landmarks against thousands of points."""
    acceptable_change_mm: float = 3.0
    """epsilon: a step is repeated until the mean change of the vertices is below (paper: 3 mm)."""
    most_repeats: int = 10
    """Solves per stiffness at most; two are usual at 3 mm."""
    gamma: float = 1.0
    """G of eq. 4 = diag(1, 1, 1, gamma). 0.1, 1 and 10 gave the same error within noise."""
    farthest_match: float = 0.08
    """A match farther away than this share of the source's diagonal gets weight 0: 60 mm on an adult."""
    widest_angle_deg: float = 60.0
    """A match whose normals differ by more gets weight 0 (Amberg, section 4.3)."""
    skip_border: bool = True
    """A match on the scan's rim gets weight 0 (Amberg, section 4.3): beyond the rim there was no camera."""
    source_vertices: int = 4500
    """About how many vertices the bent reference has. 25,000 gave the same four points (5.0 against 4.4 to
    5.0 mm) at ten times the time, so the paper's count is kept for the scan alone; see `FAITHFUL`."""
    fewest_matches: int = 50
    """With fewer, the bodies do not lie on each other and nothing is solved."""
    landmarks: tuple[LandmarkName, ...] = ("nipple_left", "nipple_right", "navel")
    """The paper's landmarks. When one of them is missing, all that are there are used."""

    def steps(self) -> Iterator[tuple[float, float]]:
        """(alpha, beta) of each step."""
        for index, alpha in enumerate(self.stiffness):
            within = index < len(self.landmark_weights)
            yield alpha, self.landmark_weights[index] if within else self.last_landmark_weight


PAPER = PaperSettings()

FAITHFUL = replace(PAPER, source_vertices=25_000)
"""As the paper, with 25,000 points on both sides."""
