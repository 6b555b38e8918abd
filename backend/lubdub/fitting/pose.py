"""Which way does an unmarked body lie? Tries the turns its shape allows and keeps the one that explains it.

A chest is nearly its own mirror image, so this never says anything about left and right beyond what a
proper rotation of a right-handed body implies; a mirrored scan comes out as an unmirrored body.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from lubdub.fitting.expected import STRICT, Expected, anybody
from lubdub.fitting.misfit import misfit_mm, with_surprise
from lubdub.fitting.shape import Pose, ShapeFitSettings, Target, expected_scales, fit_shape, shape_of
from lubdub.fitting.starts import resized
from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
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
    turned_sizes: tuple[float, ...] = (1.0, 1.2, 1.45)
    """Starts for a body with its head where the best one has its feet, as multiples of that one's size."""
    larger: float = 1.45
    """A start that many times larger at the best one's notch. A frame of a modelled woman of another origin was
    explained nearly as well by a body two thirds her size, which ended at her waist: 84 mm off, from all other starts.
    """
    kept: int = 3
    """How many of the rough fits are fitted fully."""
    rough: ShapeFitSettings = field(
        default_factory=lambda: ShapeFitSettings(
            iterations=8, first_scale_mm=60.0, last_scale_mm=15.0, modes_by_iteration=(0, 0, 0, 3, 3, 6, 6, 10)
        )
    )
    full: ShapeFitSettings = field(default_factory=lambda: ShapeFitSettings(first_scale_mm=30.0))
    unlikely: float = 0.05
    """What a breastbone a standard deviation longer or shorter than usual costs, as a share of the misfit; squared."""
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


@dataclass(frozen=True)
class _Turn:
    """A way to lie, fully fitted."""

    pose: Pose
    fit: Fit
    misfit_mm: float


def find_pose(
    scan: CleanScan, basis: ShapeBasis, settings: PoseSettings | None = None, expected: Expected | None = None
) -> PoseFound:
    """The lie of an unmarked body. scan: any axes, mm; expected: by age and sex; of anybody when None."""
    settings, expected = settings or PoseSettings(), expected or anybody(basis, STRICT)

    def scored(pose: Pose, fit: Fit, used: ShapeBasis, limit: float) -> float:
        return with_surprise(misfit_mm(pose, used, target, limit, expected), fit, expected, settings.unlikely)

    target = _thinned(scan, settings)
    coarse = _coarse(basis)

    def roughly(start: Pose) -> tuple[float, Pose]:
        pose, fit = fit_shape(target, {}, coarse, start, settings.rough, expected)
        return scored(pose, fit, coarse, 15.0), pose

    def fully(start: Pose) -> _Turn:
        pose, fit = fit_shape(target, {}, basis, start, settings.full, expected)
        return _Turn(pose, fit, scored(pose, fit, basis, 10.0))

    rough = sorted(map(roughly, _starts(target, basis, settings, expected)), key=lambda pair: pair[0])
    kept = _distinct(rough)[: settings.kept]
    turns = [fully(start) for _, start in kept]
    # A flexible body explains a lot, even upside down; a stiff one explains less but lies less: both count.
    scores = [score + turn.misfit_mm for (score, _), turn in zip(kept, turns, strict=True)]
    best, least = turns[int(np.argmin(scores))], min(scores)
    ratios = [
        score / least for score, turn in zip(scores, turns, strict=True) if _turn_between(turn.pose, best.pose) > 0.6
    ]
    larger = fully(resized(best.pose, settings.larger, best.fit.landmarks["suprasternal_notch"]))
    best = min(best, larger, key=lambda turn: turn.misfit_mm)
    upside_down = map(fully, _heads_for_feet(best.pose, basis, target, expected, settings))
    ratios += [turn.misfit_mm / best.misfit_mm for turn in upside_down]
    return PoseFound(best.pose, best.fit, best.misfit_mm, min(ratios) - 1)


def _heads_for_feet(
    pose: Pose, basis: ShapeBasis, target: Target, expected: Expected, settings: PoseSettings
) -> list[Pose]:
    """A fitted body, and the expected one in its place, with the head where the feet were: what chests hide best.

    That turn is always tried beside the best one, about as large: a rough start of its own may have shrunk to nothing,
    which proves nothing.
    """
    middle = target.points.mean(axis=0)
    half = Rotation.from_rotvec(np.pi * pose.body_from_basis.rotation[:, 2]).as_matrix()
    usual = expected_scales(expected, basis, settings.expected_sizes)
    sizes = [*settings.turned_sizes, *(scale / pose.body_from_basis.scale for scale in usual)]
    moves = [Similarity(size, half, middle - size * half @ middle) for size in sizes]
    starts = [Pose(move.after(pose.body_from_basis), expected.mean) for move in moves]
    return [replace(starts[0], coefficients=pose.coefficients), *starts]


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


def _starts(target: Target, basis: ShapeBasis, settings: PoseSettings, expected: Expected) -> list[Pose]:
    """All proper turns of the scan's principal axes, at a few sizes."""
    centre = target.points.mean(axis=0)
    spread = target.points - centre
    axes = np.linalg.svd(spread, full_matrices=False)[2]
    body = Surface(shape_of(expected.mean, basis), basis.triangles)
    trunk, normals = body.vertices[basis.data_weight > 0.5], body.normals[basis.data_weight > 0.5]
    ratio = float(np.linalg.norm(spread, axis=1).mean() / np.linalg.norm(trunk - trunk.mean(0), axis=1).mean())
    scales = [ratio * size for size in settings.sizes]
    scales += expected_scales(expected, basis, settings.expected_sizes)
    front = trunk[normals[:, 2] > 0].mean(axis=0)
    poses = [
        Pose(Similarity(scale, rotation, centre - scale * rotation @ front), expected.mean)
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
