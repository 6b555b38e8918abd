"""Which reference body is most like the scan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lubdub.geometry.frames import Similarity
from lubdub.library.similar import Overlay, ScanView, SimilaritySettings, overlay
from lubdub.results import CleanScan, Landmarks, RankedReference, Reference

WEIGHT_FALLS_MM = 1.5
"""A reference's weight falls to 1/e when its score is this much worse than the best one's."""


@dataclass(frozen=True)
class Choice:
    """The references in order of likeness, the most like one, and how it lies on the scan.

    start: the selected reference's own frame -> the scan's. notes: what was done, in words.
    """

    ranked: tuple[RankedReference, ...]
    selected: Reference
    start: Similarity
    notes: tuple[str, ...]
    overlays: tuple[Overlay, ...]
    """All overlays, in the order of `ranked`."""


def choose(
    scan: CleanScan,
    landmarks: Landmarks,
    references: Sequence[Reference],
    settings: SimilaritySettings | None = None,
    on_reference: Callable[[float], None] | None = None,
) -> Choice:
    """Lay every reference over the scan and rank them by Chamfer distance (paper, Methods).

    landmarks may be empty; they are used only to catch wrong overlays. on_reference hears the fraction done.
    Raises ValueError without a reference.
    """
    if not references:
        raise ValueError("there is no reference body to choose from")
    settings = settings or SimilaritySettings()
    view = ScanView.of(scan, settings)
    overlays = []
    for done, reference in enumerate(references, start=1):
        overlays.append(overlay(view, landmarks, reference, settings))
        if on_reference:
            on_reference(done / len(references))
    # A body that does not lie on the scan is never preferred, however near the little that overlaps.
    overlays.sort(key=lambda o: (o.coverage < settings.least_coverage, o.score_mm(settings), o.reference.id))
    scores = np.array([o.score_mm(settings) for o in overlays])
    weights = np.exp(-(scores - scores[0]).clip(0) / WEIGHT_FALLS_MM)
    weights = weights / weights.sum()
    ranked = tuple(
        RankedReference(o.reference.id, o.chamfer_mm, float(weight))
        for o, weight in zip(overlays, weights, strict=True)
    )
    return Choice(ranked, overlays[0].reference, overlays[0].start, _notes(overlays), tuple(overlays))


def _notes(overlays: Sequence[Overlay]) -> tuple[str, ...]:
    routes = Counter(o.route for o in overlays)
    notes = [f"compared with {len(overlays)} reference bodies, most like {overlays[0].reference.id}"]
    if routes["landmarks"]:
        notes.append(
            f"{routes['landmarks']} of them did not lie right by shape alone and were laid on by the landmarks"
        )
    if routes["frame"]:
        notes.append(f"{routes['frame']} of them did not lie right by shape alone and were laid on upright")
    return tuple(notes)
