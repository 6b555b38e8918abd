"""Rough overlays: from matching points in closed form, and from shape alone by FPFH, RANSAC and ICP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lubdub.geometry.frames import Similarity
from lubdub.geometry.one_thread import one_threaded_open3d


def best_rigid(source: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> Similarity:
    """The rigid motion that brings source (n, 3) nearest to target (n, 3) in the least-squares sense.

    Never a reflection: mirrored points get the best proper turn. weights: (n,) not negative. Raises
    ValueError for fewer than three pairs, or pairs on one line, which leave the turn open.
    """
    return _umeyama(source, target, weights, with_scale=False)


def best_similarity(source: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> Similarity:
    """As `best_rigid`, with one scale for all directions."""
    return _umeyama(source, target, weights, with_scale=True)


def _umeyama(source: np.ndarray, target: np.ndarray, weights: np.ndarray | None, with_scale: bool) -> Similarity:
    """Umeyama, IEEE PAMI 13 (1991), eqs. 39-43."""
    share = np.ones(len(source)) if weights is None else np.asarray(weights, np.float64)
    if len(source) < 3 or len(source) != len(target) or np.count_nonzero(share) < 3:
        raise ValueError("an overlay needs at least three pairs of points")
    share = share / share.sum()
    source_middle, target_middle = share @ source, share @ target
    a, b = source - source_middle, target - target_middle
    left, stretch, right = np.linalg.svd((b * share[:, None]).T @ a)
    if not stretch[1] > 1e-9 * max(stretch[0], 1e-300):
        raise ValueError("points on one line leave the turn open")
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left) * np.linalg.det(right))])
    rotation = (left * sign) @ right
    scale = float(stretch @ sign / (share @ (a * a).sum(1))) if with_scale else 1.0
    return Similarity(scale, rotation, target_middle - scale * rotation @ source_middle)


@dataclass(frozen=True)
class OverlaySettings:
    """How two bodies are laid over each other by shape alone."""

    thinning: float = 1 / 36
    """Spacing of the thinned points as a share of the body's diagonal: 20 mm on an adult (720 mm), as
    Open3D's guide suggests for objects this size, and proportionally less on a child."""
    feature_radius: float = 5.0
    """Radius of an FPFH, in spacings (Rusu 2009 and Open3D's guide)."""
    feature_neighbours: int = 100
    ransac_distance: float = 1.5
    """How far apart matched points may lie, in spacings."""
    edge_similarity: float = 0.9
    """Edges between matches must agree in length to this share: rejects most false triples cheaply."""
    ransac_iterations: int = 30_000
    ransac_confidence: float = 0.999
    icp_distances: tuple[float, ...] = (3.0, 1.0)
    """ICP is run once per entry, with this reach in spacings."""
    icp_iterations: int = 40
    seed: int = 20_230_519


@dataclass(frozen=True)
class FeatureCloud:
    """A body thinned for the overlay, with a Fast Point Feature Histogram for each point (Open3D objects)."""

    cloud: Any
    features: Any
    spacing_mm: float


def feature_cloud(
    points: np.ndarray, normals: np.ndarray, spacing_mm: float, settings: OverlaySettings
) -> FeatureCloud:
    """Thin points (n, 3) with unit normals (n, 3) to one a cube of spacing_mm, and describe each by its FPFH."""
    open3d = one_threaded_open3d()

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.normals = open3d.utility.Vector3dVector(normals)
    cloud = cloud.voxel_down_sample(spacing_mm)
    cloud.normalize_normals()
    reach = open3d.geometry.KDTreeSearchParamHybrid(settings.feature_radius * spacing_mm, settings.feature_neighbours)
    registration: Any = open3d.pipelines.registration  # its stub forgets which arguments may be left out
    features = registration.compute_fpfh_feature(cloud, reach)
    return FeatureCloud(cloud, features, spacing_mm)


def ransac_start(source: FeatureCloud, target: FeatureCloud, settings: OverlaySettings) -> Similarity:
    """The rigid motion most features agree on. It may be wrong by half a turn: the caller must check it."""
    open3d = one_threaded_open3d()

    registration = open3d.pipelines.registration
    reach = settings.ransac_distance * target.spacing_mm
    open3d.utility.random.seed(settings.seed)
    # Open3D writes its warnings to standard output, where a result may be expected.
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        found = registration.registration_ransac_based_on_feature_matching(
            source.cloud,
            target.cloud,
            source.features,
            target.features,
            True,
            reach,
            registration.TransformationEstimationPointToPoint(False),
            3,
            [
                registration.CorrespondenceCheckerBasedOnEdgeLength(settings.edge_similarity),
                registration.CorrespondenceCheckerBasedOnDistance(reach),
            ],
            registration.RANSACConvergenceCriteria(settings.ransac_iterations, settings.ransac_confidence),
        )
    return Similarity.from_matrix(found.transformation)


def icp(source: FeatureCloud, target: FeatureCloud, start: Similarity, settings: OverlaySettings) -> Similarity:
    """Improve a start by point-to-plane ICP on the thinned points, with a shrinking reach.

    The start's scale is kept: ICP only turns and shifts.
    """
    open3d = one_threaded_open3d()

    registration = open3d.pipelines.registration
    matrix = start.matrix()
    for reach in settings.icp_distances:
        found = registration.registration_icp(
            source.cloud,
            target.cloud,
            reach * target.spacing_mm,
            matrix,
            registration.TransformationEstimationPointToPlane(),
            registration.ICPConvergenceCriteria(max_iteration=settings.icp_iterations),
        )
        matrix = found.transformation
    return Similarity.from_matrix(matrix)
