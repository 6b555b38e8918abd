"""What colours add to a scan: by printed stickers two bones that are marked already, a check of its size, and its
handedness; and the tint of the skin, by which areolas and navel are found later.

Joins reading and cleaning (`scans`) with finding stickers (`landmarks`); the pipeline takes this step first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lubdub.fitting.pose import find_pose
from lubdub.geometry.colour import Colouring, Tint
from lubdub.geometry.frames import MM_PER_UNIT
from lubdub.geometry.stickers import BONES, SeenSticker, StickerProof
from lubdub.geometry.surface import Surface
from lubdub.landmarks import sticker_reasons
from lubdub.landmarks.frame import can_frame, long_axis
from lubdub.landmarks.reasons import UPSIDE_DOWN
from lubdub.landmarks.stickers import find_stickers
from lubdub.landmarks.tint import tint_of
from lubdub.results import (
    BONE_LANDMARKS,
    LANDMARK_NAMES,
    NIPPLES,
    CleanScan,
    LandmarkName,
    RawScan,
    Reason,
    ScanRefused,
    ShapeBasis,
    Unit,
)
from lubdub.scans.clean import clean
from lubdub.scans.reasons import MIRRORED_FILE
from lubdub.scans.units import find_unit


@dataclass(frozen=True)
class StickerGates:
    """What stickers and a person's own marks may disagree about."""

    order_margin: float = 0.15
    """Below it the shape is not sure which end has the head: wrong 1 time in 30, right 29 times with up to 1.0."""
    scale_care: float = 0.05
    """A sheet printed to fit the page is 3-6 % small, phone scans are 1-3 % off; measured error of reading 1 %."""
    scale_refuse: float = 0.2
    unit_tolerance: float = 0.2
    """Metres, centimetres and millimetres lie a factor of ten apart."""
    moved_mm: float = 6.0
    """A mark nearer to its sticker than this was accepted, not moved."""
    care_mm: float = 25.0


GATES = StickerGates()
SOFT: frozenset[LandmarkName] = frozenset(set(LANDMARK_NAMES) - set(BONE_LANDMARKS))
"""What skin may show by its colour."""


@dataclass(frozen=True)
class Prepared:
    """A clean scan with all that is marked on it. marked: name -> (3,) in the file's coordinates, clicks and stickers
    together; by_sticker: which of them stickers gave; tint: the skin's colours, where they can still find something."""

    scan: CleanScan
    marked: Mapping[LandmarkName, np.ndarray]
    by_sticker: frozenset[LandmarkName] = frozenset()
    proof: StickerProof | None = None
    warnings: tuple[Reason, ...] = ()
    tint: Tint | None = None


def prepare(raw: RawScan, unit_given: str | None, clicked: Mapping[LandmarkName, np.ndarray]) -> Prepared:
    """Unit, cleaning, stickers and colours. clicked: name -> (3,) in the file's coordinates.

    Raises ScanUnreadable and ScanRefused as `find_unit` and `clean` do, and ScanRefused when stickers show that the
    scan is mirrored or its size untrue.
    """
    unit = find_unit(raw, unit_given, clicked)
    scan = clean(raw, unit, clicked)
    if raw.colouring is None:
        return Prepared(scan, clicked)
    ready = _with_stickers(raw, raw.colouring, unit, scan, clicked)
    if set(clicked) >= SOFT:
        return ready
    return replace(ready, tint=tint_of(raw.surface, raw.colouring, ready.scan))


def _with_stickers(
    raw: RawScan, colouring: Colouring, unit: Unit, scan: CleanScan, clicked: Mapping[LandmarkName, np.ndarray]
) -> Prepared:
    seen = _seen(raw, colouring, scan)
    if not seen:
        return Prepared(scan, clicked)
    _check_sides(seen)
    scale = float(np.mean([one.scale for one in seen]))
    better = _better_unit(unit, scale)
    if better is not None:
        scan, seen = clean(raw, better, clicked), _rescaled(seen, unit, better)
        scale *= better.mm_per_unit / unit.mm_per_unit
    return _marked(scan, seen, clicked, scale)


def check_order(ready: Prepared, basis: ShapeBasis) -> Prepared:
    """Whether the body lies as its points say, when they fix its long axis and nothing else would show them reversed.

    Both nipples would: with head and feet exchanged, left and right no longer fit the front. Raises ScanRefused when
    the scan's shape clearly has its head at the other end, warns when it seems so.
    """
    marked = {name: ready.scan.body_from_file.apply(place) for name, place in ready.marked.items()}
    if not can_frame(marked) or marked.keys() >= NIPPLES:
        return ready
    found = find_pose(ready.scan, basis)
    if found.pose.body_from_basis.rotation[:, 1] @ long_axis(marked) > 0:
        return ready
    reason = sticker_reasons.SWAPPED if ready.by_sticker == set(BONES) else UPSIDE_DOWN
    if found.margin > GATES.order_margin:
        raise ScanRefused(reason)
    return replace(ready, warnings=(*ready.warnings, reason))


def _seen(raw: RawScan, colouring: Colouring, scan: CleanScan) -> tuple[SeenSticker, ...]:
    surface = Surface(scan.body_from_file.apply(raw.surface.vertices), raw.surface.triangles)
    return find_stickers(surface, colouring, scan)


def _check_sides(seen: tuple[SeenSticker, ...]) -> None:
    if all(one.is_mirrored for one in seen):
        raise ScanRefused(sticker_reasons.MIRRORED)
    if any(one.is_mirrored for one in seen):
        raise ScanRefused(sticker_reasons.CONTRADICTORY)


def _better_unit(unit: Unit, scale: float) -> Unit | None:
    """The unit that the stickers' size calls for, when nobody named another."""
    if unit.source == "given" or abs(scale - 1) < GATES.scale_refuse:
        return None
    for name, mm_per_unit in MM_PER_UNIT.items():
        if abs(scale * mm_per_unit / unit.mm_per_unit - 1) < GATES.unit_tolerance:
            return Unit(name, mm_per_unit, "sticker")
    return None


def _rescaled(seen: tuple[SeenSticker, ...], unit: Unit, better: Unit) -> tuple[SeenSticker, ...]:
    factor = better.mm_per_unit / unit.mm_per_unit
    return tuple(replace(one, position=one.position * factor, scale=one.scale * factor) for one in seen)


def _marked(
    scan: CleanScan, seen: tuple[SeenSticker, ...], clicked: Mapping[LandmarkName, np.ndarray], scale: float
) -> Prepared:
    if abs(scale - 1) > GATES.scale_refuse:
        raise ScanRefused(sticker_reasons.LARGER_THAN_PRINTED if scale > 1 else sticker_reasons.SMALLER_THAN_PRINTED)
    warnings: list[Reason] = []
    if abs(scale - 1) > GATES.scale_care:
        warnings.append(sticker_reasons.A_LITTLE_LARGER if scale > 1 else sticker_reasons.A_LITTLE_SMALLER)
    marked, by_sticker = dict(clicked), set()
    for bone in BONES:
        places = [one.position for one in seen if one.sticker.bone == bone]
        if len(places) > 1:
            warnings.append(sticker_reasons.TWICE)
        if len(places) != 1:
            continue
        in_file = scan.body_from_file.inverse().apply(places[0])
        distance = 0.0
        if bone in clicked:
            distance = float(np.linalg.norm(np.asarray(clicked[bone]) - in_file)) * scan.body_from_file.scale
        if distance <= GATES.moved_mm:
            marked[bone] = in_file
            by_sticker.add(bone)
        elif distance > GATES.care_mm:
            warnings.append(sticker_reasons.AWAY_FROM_STICKER[bone])
    found = tuple(bone for bone in BONES if any(one.sticker.bone == bone for one in seen))
    proof = StickerProof(found, round(scale, 4))
    proved = replace(scan, warnings=tuple(reason for reason in scan.warnings if reason != MIRRORED_FILE))
    return Prepared(proved, marked, frozenset(by_sticker), proof, tuple(warnings))
