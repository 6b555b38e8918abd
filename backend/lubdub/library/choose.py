"""Which reference body is most like the scan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from lubdub.geometry.frames import Similarity
from lubdub.library.nearest import ShapeIndex, index_of
from lubdub.library.similar import Overlay, ScanView, SimilaritySettings, overlay
from lubdub.results import CleanScan, Landmarks, RankedReference, Reference

WEIGHT_FALLS_MM = 1.5
"""A reference's weight falls to 1/e when its score is this much worse than the best one's."""


_BEST_FOLLOWED = 3
"""In a large library, bodies like these many of the best laid on first are laid on too. Of 240 drawn bodies 100 laid on
found the same one as laying on all, on three of three scans; so did 60."""


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
    Of a library beyond `settings.most_laid` only a part is laid on: bodies spread over all its shapes first, then
    those most like the best of these. Raises ValueError without a reference.
    """
    if not references:
        raise ValueError("there is no reference body to choose from")
    settings = settings or SimilaritySettings()
    overlays = _laid_on(scan, landmarks, references, settings, on_reference or (lambda fraction: None))
    overlays.sort(key=lambda laid: _badness(laid, settings))
    scores = np.array([o.score_mm(settings) for o in overlays])
    weights = np.exp(-(scores - scores[0]).clip(0) / WEIGHT_FALLS_MM)
    weights = weights / weights.sum()
    ranked = tuple(
        RankedReference(o.reference.id, o.chamfer_mm, float(weight))
        for o, weight in zip(overlays, weights, strict=True)
    )
    notes = _notes(overlays, len(references))
    return Choice(ranked, overlays[0].reference, overlays[0].start, notes, tuple(overlays))


def _laid_on(
    scan: CleanScan,
    landmarks: Landmarks,
    references: Sequence[Reference],
    settings: SimilaritySettings,
    on_reference: Callable[[float], None],
) -> list[Overlay]:
    """Overlays of all references, or of the part of a large library that matters."""
    view, overlays = ScanView.of(scan, settings), list[Overlay]()
    total = min(len(references), settings.most_laid)

    def lay(places: Iterable[int]) -> None:
        for place in places:
            overlays.append(overlay(view, landmarks, references[place], settings))
            on_reference(len(overlays) / total)

    if len(references) <= settings.most_laid:
        lay(range(len(references)))
        return overlays
    index = index_of(references)
    spread = index.spread(settings.most_laid // 2)
    lay(spread)
    best_first = sorted(range(len(spread)), key=lambda number: _badness(overlays[number], settings))
    lay(_around([spread[number] for number in best_first], index, settings.most_laid - len(spread)))
    return overlays


def _badness(laid: Overlay, settings: SimilaritySettings) -> tuple[bool, float, str]:
    """What overlays are sorted by. One that does not lie on the scan is last, however near the little that overlaps."""
    return laid.coverage < settings.least_coverage, laid.score_mm(settings), laid.reference.id


def _around(best_first: Sequence[int], index: ShapeIndex, count: int) -> list[int]:
    """`count` bodies of the library that are most like the first few of those laid on, and not among them."""
    # In turns: the nearest of each, then the second nearest, so that none of the few is left out.
    enough = count + len(best_first)
    turns = [
        [place for place in index.like(best, enough) if place not in best_first] for best in best_first[:_BEST_FOLLOWED]
    ]
    in_turns = dict.fromkeys(place for row in zip_longest(*turns) for place in row if place is not None)
    return list(in_turns)[:count]


def _notes(overlays: Sequence[Overlay], of: int) -> tuple[str, ...]:
    routes = Counter(o.route for o in overlays)
    compared = f"{len(overlays)}" if len(overlays) == of else f"{len(overlays)} of {of}"
    notes = [f"compared with {compared} reference bodies, most like {overlays[0].reference.id}"]
    if routes["landmarks"]:
        notes.append(
            f"{routes['landmarks']} of them did not lie right by shape alone and were laid on by the landmarks"
        )
    if routes["frame"]:
        notes.append(f"{routes['frame']} of them did not lie right by shape alone and were laid on upright")
    return tuple(notes)
