"""Which way does an unmarked body lie? Tries the turns its shape allows and keeps the one that explains it.

A chest is nearly its own mirror image, so this never says anything about left and right beyond what a
proper rotation of a right-handed body implies; a mirrored scan comes out as an unmirrored body.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np

from lubdub.fitting.misfit import misfit_mm, with_surprise
from lubdub.fitting.shape import Pose, ShapeFitSettings, Span, Target, carried, fit_shape, start_pose, sternum_mm
from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface, vertex_normals
from lubdub.results import CleanScan, Fit, ShapeBasis


@dataclass(frozen=True)
class PoseSettings:
    """How the turns are tried. All starts take all rough steps: dropping the worse ones half-way saved 0.6 s, but in
    one of 70 simulated people, a baby, the start that wins in the end was 59th of 80 there."""

    scan_points: int = 3000
    sizes: tuple[float, ...] = (0.8, 1.1)
    """Starts for the body's size, as a multiple of what the scan's spread suggests."""
    expected_sizes: tuple[float, ...] = (1.0, 1.25)
    """The same as a multiple of what the expected breastbone suggests: a phone's scan of a baby shows much bed."""
    kept: int = 3
    """How many of the rough fits are fitted fully."""
    rough: ShapeFitSettings = field(
        default_factory=lambda: ShapeFitSettings(
            iterations=8, first_scale_mm=60.0, last_scale_mm=15.0, modes_by_iteration=(0, 0, 0, 3, 3, 6, 6, 10)
        )
    )
    full: ShapeFitSettings = field(default_factory=lambda: ShapeFitSettings(first_scale_mm=30.0))
    unlikely: float = 0.05
    """What a breastbone one standard deviation off its expected length costs, as a share of the misfit; squared."""
    seed: int = 7


@dataclass(frozen=True)
class PoseFound:
    """The best pose and its fit; margin: how much better it explains the scan than any other turn (0: not).

    misfit_mm: what the fit leaves unexplained, see `misfit`, more for an unexpected size.
    """

    pose: Pose
    fit: Fit
    misfit_mm: float
    margin: float


def find_pose(
    scan: CleanScan, basis: ShapeBasis, settings: PoseSettings | None = None, sternum: Span | None = None
) -> PoseFound:
    """The lie of an unmarked body. scan: any axes, mm; sternum: what age and sex let one expect."""
    settings = settings or PoseSettings()

    def scored(misfit: float, fit: Fit) -> float:
        return with_surprise(misfit, fit, sternum, settings.unlikely)

    target = _thinned(scan, settings)
    coarse = _coarse(basis)
    rough = []
    for start in _starts(target, basis, settings, sternum):
        pose, fit = fit_shape(target, {}, coarse, start, settings.rough, sternum)
        rough.append((scored(misfit_mm(pose, coarse, target, 15.0), fit), pose))
    rough.sort(key=lambda pair: pair[0])
    # A flexible body explains a lot, even upside down; a stiff one explains less but lies less: both count.
    full = []
    for score, pose in _distinct(rough)[: settings.kept]:
        final, fit = fit_shape(target, {}, basis, pose, settings.full, sternum)
        misfit = scored(misfit_mm(final, basis, target, 10.0), fit)
        full.append((score + misfit, final, fit, misfit))
    full.sort(key=lambda end: end[0])
    best = full[0]
    others = [score for score, pose, *_ in full[1:] if _turn_between(pose, best[1]) > 0.6]
    margin = min(others) / best[0] - 1 if others else 1.0
    return PoseFound(best[1], best[2], best[3], margin)


def _thinned(scan: CleanScan, settings: PoseSettings) -> Target:
    count = len(scan.points)
    picked = np.random.default_rng(settings.seed).permutation(count)[: settings.scan_points]
    return Target.of(
        replace(scan, points=scan.points[picked], normals=scan.normals[picked], is_border=scan.is_border[picked])
    )


def _coarse(basis: ShapeBasis) -> ShapeBasis:
    """The basis with every third vertex counted: enough for a rough pose."""
    weight = basis.data_weight.copy()
    weight[np.arange(len(weight)) % 3 != 0] = 0.0
    return replace(basis, data_weight=weight)


def _starts(target: Target, basis: ShapeBasis, settings: PoseSettings, sternum: Span | None) -> list[Pose]:
    """All proper turns of the scan's principal axes, at a few sizes."""
    centre = target.points.mean(axis=0)
    spread = target.points - centre
    axes = np.linalg.svd(spread, full_matrices=False)[2]
    trunk = basis.mean[basis.data_weight > 0.5]
    ratio = float(np.linalg.norm(spread, axis=1).mean() / np.linalg.norm(trunk - trunk.mean(0), axis=1).mean())
    scales = [ratio * size for size in settings.sizes]
    if sternum is not None:
        mean = carried(Surface(basis.mean, basis.triangles), basis)
        scales += [sternum.length_mm / sternum_mm(mean) * size for size in settings.expected_sizes]
    front = trunk[vertex_normals(basis.mean, basis.triangles)[basis.data_weight > 0.5][:, 2] > 0].mean(axis=0)
    poses = [
        start_pose(Similarity(scale, rotation, centre - scale * rotation @ front), basis)
        for scale, rotation in itertools.product(scales, _proper_turns(axes))
    ]
    return [pose for pose in poses if _faces_the_scanned_side(pose, target)]


def _proper_turns(axes: np.ndarray) -> list[np.ndarray]:
    """The 24 rotations that lay the body's axes along the three given rows."""
    turns = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            rotation = (axes[list(order)] * np.array(signs)[:, None]).T
            if np.linalg.det(rotation) > 0:
                turns.append(rotation)
    return turns


def _faces_the_scanned_side(pose: Pose, target: Target) -> bool:
    """False when the body's front would look away from the side that was scanned; always True for whole bodies."""
    outward = target.normals.mean(axis=0)
    return bool(pose.body_from_basis.rotation[:, 2] @ outward > -0.3)


def _distinct(rough: list[tuple[float, Pose]]) -> list[tuple[float, Pose]]:
    kept: list[tuple[float, Pose]] = []
    for score, pose in rough:
        if all(_turn_between(pose, other) > 0.35 for _, other in kept):
            kept.append((score, pose))
    return kept


def _turn_between(first: Pose, second: Pose) -> float:
    """Angle between two poses, radians."""
    relative = first.body_from_basis.rotation @ second.body_from_basis.rotation.T
    return float(np.arccos(np.clip((np.trace(relative) - 1) / 2, -1, 1)))
