"""The paper's method: bend one reference body onto the scan and carry its four areas over."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from lubdub.fitting.matches import Target
from lubdub.fitting.nonrigid import BendStep, MarkPairs, NothingMatches, bend
from lubdub.fitting.schedule import PAPER, PaperSettings
from lubdub.geometry.anchors import anchored
from lubdub.geometry.frames import Similarity
from lubdub.geometry.resample import area_mm2, front_shell, subdivided
from lubdub.geometry.surface import Surface
from lubdub.results import CleanScan, Fit, LandmarkName, Landmarks, Reason, Reference, ScanRefused

Name = TypeVar("Name", bound=str)

NO_OVERLAP = Reason(
    "no_overlap",
    "The reference body could not be laid over this scan.",
    "Check that the scan shows the whole chest from the collarbones to the belly button, and mark the points again.",
)


def fit_paper(
    scan: CleanScan,
    landmarks: Landmarks,
    reference: Reference,
    start: Similarity,
    settings: PaperSettings = PAPER,
    on_step: Callable[[BendStep], None] | None = None,
) -> Fit:
    """Bend `reference`, first moved by `start`, onto the scan by landmark-guided non-rigid ICP.

    The fit's surface is the reference's front, its areas and landmarks are the reference's own, carried by
    the triangles they lie on. on_step hears of every solve. strangeness is 0: this method has no shape
    model to be strange against. Raises ScanRefused when reference and scan do not lie on each other.
    """
    front = front_of(reference, settings.source_vertices)
    source = Surface(start.apply(front.vertices), front.triangles)
    target = Target(scan.points, scan.normals, scan.is_border)
    marks = _mark_pairs(reference, start, landmarks, settings.landmarks)
    steps: list[BendStep] = []
    try:
        for step in bend(source, target, marks, settings):
            steps.append(step)
            if on_step:
                on_step(step)
    except NothingMatches as error:
        raise ScanRefused(NO_OVERLAP) from error
    last = steps[-1]
    gaps = np.linalg.norm(last.vertices - last.matches.points, axis=1)[last.matches.trusted]
    return Fit(
        surface=Surface(last.vertices, front.triangles),
        landmarks=_carried(reference.landmarks, front, last.vertices),
        areas=_carried(reference.areas, front, last.vertices),
        surface_residual_mm=float(np.sqrt((gaps**2).mean())),
        matched_share=last.matched_share,
        strangeness=0.0,
        steps=tuple(step.numbers() for step in steps),
    )


def front_of(reference: Reference, vertices: int) -> Surface:
    """The reference's front, with about as many vertices as asked for (never fewer than it has)."""
    front = front_shell(reference.surface)
    # Equilateral triangles of edge e: sqrt(3)/2 e^2 of skin for each vertex. Halving edges down to a longest
    # one leaves an average of about 0.58 of it (counted on references of 3,000 to 25,000 vertices).
    edge = np.sqrt(area_mm2(front) / vertices * 2 / np.sqrt(3))
    return subdivided(front, float(edge / 0.58))


def _mark_pairs(
    reference: Reference, start: Similarity, landmarks: Landmarks, wanted: tuple[LandmarkName, ...]
) -> MarkPairs:
    """The landmarks that both sides have: those wanted, or, if one of these is missing, all."""
    both = [name for name in reference.landmarks if name in landmarks]
    names = list(wanted) if set(wanted) <= set(both) else both
    if not names:
        return MarkPairs(np.zeros((0, 3)), np.zeros((0, 3)))
    on_source = start.apply(np.array([reference.landmarks[name] for name in names]))
    return MarkPairs(on_source, np.array([landmarks[name].position for name in names]))


def _carried(places: Mapping[Name, np.ndarray], before: Surface, after: np.ndarray) -> dict[Name, np.ndarray]:
    """Places on a surface, wherever its vertices are now. after: (n, 3)."""
    names = list(places)
    moved = anchored(before, np.array([places[name] for name in names])).on(after)
    return dict(zip(names, moved, strict=True))
