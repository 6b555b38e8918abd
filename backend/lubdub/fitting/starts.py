"""Several starts for one shape fit, when no clicked bone fixes the body's size.

A fit slides along smooth skin with friction and ends near where it began, so a start that is a fifth too small
ends too small. The skin itself, neck and shoulders above all, tells which end explains it best.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.fitting.misfit import misfit_mm
from lubdub.fitting.shape import Pose, Pull, Span, Target, fit_shape
from lubdub.geometry.frames import Similarity
from lubdub.results import Fit, LandmarkName, ShapeBasis


@dataclass(frozen=True)
class StartSettings:
    """Which sizes are tried, as multiples of the first guess, and how far a misfit counts."""

    sizes: tuple[float, ...] = (0.9, 1.05, 1.25)
    """On a real woman from CT with nipples and navel clicked: notch 40 mm too low from one start, 10 from several."""
    misfit_limit_mm: float = 5.0
    unlikely_mm: float = 1.0
    """What a breastbone one standard deviation off its expected length costs, in mm of misfit; squared beyond."""


def fit_from_sizes(
    target: Target,
    pulls: Mapping[LandmarkName, Pull],
    basis: ShapeBasis,
    start: Pose,
    settings: StartSettings | None = None,
    sternum: Span | None = None,
) -> tuple[Pose, Fit]:
    """The shape fit from each size, about the middle of the pulls (of the scan without any); the best explained."""
    settings = settings or StartSettings()
    places = [pull.position for pull in pulls.values()]
    middle = np.mean(places if places else target.points, axis=0)
    ends = [fit_shape(target, pulls, basis, _resized(start, size, middle), sternum=sternum) for size in settings.sizes]

    def cost(end: tuple[Pose, Fit]) -> float:
        misfit = misfit_mm(end[0], basis, target, settings.misfit_limit_mm)
        return misfit + (settings.unlikely_mm * sternum.surprise(end[1]) if sternum else 0.0)

    return min(ends, key=cost)


def _resized(start: Pose, size: float, middle: np.ndarray) -> Pose:
    old = start.body_from_basis
    grown = Similarity(size * old.scale, old.rotation, middle + size * (old.translation - middle))
    return Pose(grown, start.coefficients)
