"""How like the scan one reference body is: lay it over the scan, then measure the Chamfer distance of eq. 1."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.chamfer import trimmed_mean
from lubdub.geometry.frames import Similarity
from lubdub.geometry.resample import front_shell, spread_points, thin
from lubdub.geometry.rigid import (
    FeatureCloud,
    OverlaySettings,
    best_similarity,
    feature_cloud,
    icp,
    ransac_start,
)
from lubdub.geometry.surface import Surface
from lubdub.results import CleanScan, Landmarks, Reference

Route = Literal["shape", "landmarks", "frame"]
"""How a reference came to lie on the scan: by FPFH, RANSAC and ICP as in the paper; by the landmarks; or by
the body frame, when shape failed and there are no landmarks."""


@dataclass(frozen=True)
class SimilaritySettings:
    """How references are laid over a scan, and which overlays are believed."""

    overlay: OverlaySettings = field(default_factory=OverlaySettings)
    least_forward: float = 0.05
    """The smallest z of a normal that still faces the front, on scan and reference alike."""
    dense_spacing: float = 1 / 110
    """Spacing of the points a distance is measured to, as a share of the reference's diagonal: 6.5 mm on an adult,
    within the 5-14 mm of the paper's camera."""
    keep: float = 1.0
    """The share of gaps that count: all, as in the paper. Leaving out the largest fifth, mostly arms that lie
    otherwise, lowers the distances but chose the same bodies on nine scans."""
    query_spacing: float = 1 / 60
    """Spacing of the points a distance is measured from: 12 mm on an adult, about 1,500 points."""
    landmark_gate_mm: float = 30.0
    """An overlay by shape whose landmarks are farther off than this (root mean square) is done again from the
    landmarks. FPFH alone flipped a fifth of all pairs, by hundreds of millimetres; a good one of another body
    is 10-25 mm off."""
    turn_gate_deg: float = 45.0
    """Scan and reference are both in the body frame, so an overlay that turns by more is wrong."""
    least_coverage: float = 0.5
    """An overlay that covers less of the scan than this has slid off it."""
    flat_landmarks: float = 0.2
    """Landmarks less wide than this share of their length leave the turn about that length open."""
    hopeless_scale: float = 1.5
    """A body this much larger or smaller by its landmarks cannot lie on the scan unscaled: it is laid on by them
    at once. An infant's scan against all adults otherwise takes most of the time of a choice."""
    most_laid: int = 100
    """Laying one on takes 25 ms. Of a larger library only so many are laid on: see `library.choose`."""
    scale_penalty_mm: float = 20.0
    """Added for each factor e of scale: a landmark start may scale a child up to an adult, which then fits
    well with the wrong proportions (measured: mean error 7.3 -> 6.4 mm)."""


@dataclass(frozen=True)
class ScanView:
    """The front of a scan made ready to be compared with many references.

    Only skin that faces the front: an overhead camera sees no more, and a phone walked around a body that shows
    its flanks and arms must not look less like a reference's front for it.
    """

    features: FeatureCloud
    tree: cKDTree
    on_rim: np.ndarray
    queries: np.ndarray
    diagonal_mm: float

    @staticmethod
    def of(scan: CleanScan, settings: SimilaritySettings) -> ScanView:
        """Build it. Costs about a tenth of a second."""
        front = scan.normals[:, 2] > settings.least_forward
        front = front if front.any() else np.ones(len(front), bool)
        points, normals, on_rim = scan.points[front], scan.normals[front], scan.is_border[front]
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        queries = thin(points, normals, on_rim, settings.query_spacing * diagonal).points
        features = feature_cloud(points, normals, settings.overlay.thinning * diagonal, settings.overlay)
        return ScanView(features, cKDTree(points), on_rim, queries, diagonal)


@dataclass(frozen=True)
class Overlay:
    """A reference laid over the scan. start: reference -> scan; coverage: share of the scan compared, 0 to 1."""

    reference: Reference
    start: Similarity
    route: Route
    chamfer_mm: float
    coverage: float
    landmark_residual_mm: float | None

    def score_mm(self, settings: SimilaritySettings) -> float:
        """What references are ranked by: the Chamfer distance, plus a penalty for having been scaled."""
        return self.chamfer_mm + settings.scale_penalty_mm * abs(float(np.log(self.start.scale)))


def overlay(view: ScanView, landmarks: Landmarks, reference: Reference, settings: SimilaritySettings) -> Overlay:
    """Lay a reference over the scan by shape, as in the paper; check it; and if it is wrong, do it again otherwise."""
    shell = front_shell(reference.surface, settings.least_forward)
    body = _ReferenceView.of(shell, view.diagonal_mm, settings)

    def laid(start: Similarity, route: Route) -> Overlay:
        chamfer, coverage = _compare(view, body, start, settings.keep)
        residual = landmark_residual_mm(reference, landmarks, start)
        return Overlay(reference, start, route, chamfer, coverage, residual)

    by_landmarks = landmark_start(reference, landmarks, settings)
    if by_landmarks is not None and abs(np.log(by_landmarks.scale)) > np.log(settings.hopeless_scale):
        return laid(by_landmarks, "landmarks")
    features = feature_cloud(shell.vertices, shell.normals, view.features.spacing_mm, settings.overlay)
    rough = ransac_start(features, view.features, settings.overlay)
    by_shape = laid(icp(features, view.features, rough, settings.overlay), "shape")
    if is_believable(by_shape, landmarks, settings):
        return by_shape
    if by_landmarks is not None:
        return laid(by_landmarks, "landmarks")
    shift = view.queries.mean(axis=0) - shell.vertices.mean(axis=0)
    upright = Similarity(1.0, np.eye(3), shift)
    return laid(icp(features, view.features, upright, settings.overlay), "frame")


def is_believable(found: Overlay, landmarks: Landmarks, settings: SimilaritySettings) -> bool:
    """Whether an overlay by shape alone may be used: not flipped, not slid off, landmarks where they belong."""
    turn = np.rad2deg(np.arccos(np.clip((np.trace(found.start.rotation) - 1) / 2, -1, 1)))
    if turn > settings.turn_gate_deg or found.coverage < settings.least_coverage:
        return False
    if found.landmark_residual_mm is None:
        return True
    doubt = np.sqrt(np.mean([mark.uncertainty_mm**2 for mark in landmarks.values()]))
    return bool(found.landmark_residual_mm <= settings.landmark_gate_mm + 2 * doubt)


def landmark_residual_mm(reference: Reference, landmarks: Landmarks, start: Similarity) -> float | None:
    """Root mean square distance of the landmarks after an overlay, or None without any."""
    names = [name for name in landmarks if name in reference.landmarks]
    if not names:
        return None
    moved = start.apply(np.array([reference.landmarks[name] for name in names]))
    gaps = np.linalg.norm(moved - np.array([landmarks[name].position for name in names]), axis=1)
    return float(np.sqrt((gaps**2).mean()))


def landmark_start(reference: Reference, landmarks: Landmarks, settings: SimilaritySettings) -> Similarity | None:
    """The similarity that brings the reference's landmarks to the scan's, or None with fewer than two.

    Landmarks near one line (the midline alone) do not say how the body is turned about it; both being in
    the body frame, the turn is then left out and only scale and place are taken.
    """
    names = [name for name in landmarks if name in reference.landmarks]
    if len(names) < 2:
        return None
    source = np.array([reference.landmarks[name] for name in names])
    target = np.array([landmarks[name].position for name in names])
    weights = np.array([landmarks[name].uncertainty_mm for name in names]) ** -2.0
    size = np.linalg.svd(source - source.mean(axis=0), compute_uv=False)
    if len(names) >= 3 and size[1] > settings.flat_landmarks * size[0]:
        return best_similarity(source, target, weights)
    share = weights / weights.sum()
    source_middle, target_middle = share @ source, share @ target
    scale = float(np.linalg.norm(target - target_middle) / np.linalg.norm(source - source_middle))
    return Similarity(scale, np.eye(3), target_middle - scale * source_middle)


@dataclass(frozen=True)
class _ReferenceView:
    """The front of a reference in its own frame: dense points to measure to, and thinned ones to measure from."""

    tree: cKDTree
    on_rim: np.ndarray
    queries: np.ndarray

    @staticmethod
    def of(shell: Surface, scan_diagonal_mm: float, settings: SimilaritySettings) -> _ReferenceView:
        diagonal = float(np.linalg.norm(np.ptp(shell.vertices, axis=0)))
        points, on_rim = spread_points(shell, settings.dense_spacing * diagonal)
        queries = thin(points, np.zeros_like(points), on_rim, settings.query_spacing * scan_diagonal_mm).points
        # Unbalanced, the tree is built three times as fast and answers as well.
        return _ReferenceView(cKDTree(points, balanced_tree=False, compact_nodes=False), on_rim, queries)


def _compare(view: ScanView, body: _ReferenceView, start: Similarity, keep: float) -> tuple[float, float]:
    """Chamfer distance on the overlap of scan and reference front, and the share of the scan in it.

    The scan shows one side only and ends where the camera's view ended, and the reference ends at chin and
    hip; what only one of them shows says nothing about likeness. So the reference's back is left out, and
    with it, in either direction, every point whose nearest neighbour lies on the other's rim.
    """
    to_reference, nearest = body.tree.query(start.inverse().apply(view.queries))
    scan_inside = ~body.on_rim[nearest]
    to_scan, nearest = view.tree.query(start.apply(body.queries))
    reference_inside = ~view.on_rim[nearest]
    coverage = float(scan_inside.mean())
    if not scan_inside.any() or not reference_inside.any():
        return view.diagonal_mm, 0.0
    there = start.scale * trimmed_mean(to_reference[scan_inside], keep)
    return (there + trimmed_mean(to_scan[reference_inside], keep)) / 2, coverage
