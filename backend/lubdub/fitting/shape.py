"""Fitting the shape basis: a similarity and a few coefficients, by Gauss-Newton on matched skin.

Minimises, over scale, rotation, translation and coefficients c,
    sum w_i ((x_i - u_i) . n_i)² / s²  +  a whisper of the same point to point  +  sum |x_l - l|² / s_l²
    + (c - m)^T P (c - m)  +  (|x_notch - x_joint| - S)² / s_S²
where m, P and S are the coefficients, their precision and the breastbone's length that age and sex let one expect, u_i
the scan point nearest to body vertex x_i and w_i a Geman-McClure weight whose scale is annealed (Black & Rangarajan
1996). Many modes join late, so that the pose settles first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from lubdub.fitting.expected import Expected, anybody
from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface, carry, vertex_normals
from lubdub.results import AREA_NAMES, BONE_LANDMARKS, LANDMARK_NAMES, CleanScan, Fit, LandmarkName, ShapeBasis


@dataclass(frozen=True)
class ShapeFitSettings:
    """Measured on 40 simulated one-sided scans unless said; see docs of the benchmark."""

    iterations: int = 16
    first_scale_mm: float = 20.0
    last_scale_mm: float = 3.0
    """Geman-McClure scale, annealed geometrically: 20 -> 3 gave 3.9 mm, 40 -> 6 gave 4.35."""
    modes_by_iteration: tuple[int, ...] = (0, 6, 6, 15, 15, 15, 40, 40)
    """Modes let in at the first iterations; all of them afterwards."""
    data_sigma_mm: float = 3.0
    effective_points: float = 100.0
    """All matches together count as this many independent ones: what the model cannot bend to is wrong over a hand's
    breadth, so a chest holds some dozens of independent errors. 1500 put the notch 1.3 times as far off as 100."""
    point_to_point: float = 0.03
    """The nearest point holds a body where it is: 0.1 and 0.3 kept a wrong start twice as far off."""
    match_angle_deg: float = 55.0
    coefficient_limit: float = 3.5
    step_limit: float = 0.3
    """Largest change of log scale in one step, and of the rotation in radians."""


@dataclass(frozen=True)
class Target:
    """What a body is fitted to: a clean scan and its search tree, built once for all fits."""

    points: np.ndarray
    normals: np.ndarray
    is_border: np.ndarray
    tree: cKDTree

    @staticmethod
    def of(scan: CleanScan) -> Target:
        """The target a scan makes."""
        return Target(scan.points, scan.normals, scan.is_border, cKDTree(scan.points))


@dataclass(frozen=True)
class Pull:
    """A landmark that pulls: (3,) position and its standard deviation."""

    position: np.ndarray
    sigma_mm: float


@dataclass(frozen=True)
class Pose:
    """State of the fit: basis -> body frame, and (k,) coefficients."""

    body_from_basis: Similarity
    coefficients: np.ndarray


@dataclass(frozen=True)
class _Matches:
    """Body vertices that found skin: their indices, the scan points, normals and weights."""

    vertices: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    weights: np.ndarray
    share: float


def fit_shape(
    target: Target,
    pulls: Mapping[LandmarkName, Pull],
    basis: ShapeBasis,
    start: Pose,
    settings: ShapeFitSettings | None = None,
    expected: Expected | None = None,
) -> tuple[Pose, Fit]:
    """Bend the basis onto the target, from a start that is right to about 30 degrees and a third in size.

    expected: by age and sex; of anybody when None. Works in whatever millimetre frame the target is in. Returns the
    final pose and the fitted body.
    """
    settings, expected = settings or ShapeFitSettings(), expected or anybody(basis)
    scales = np.geomspace(settings.first_scale_mm, settings.last_scale_mm, settings.iterations)
    pose, begun, steps = start, shape_of(start.coefficients, basis), []
    for iteration, scale in enumerate(scales):
        modes = _modes_at(iteration, len(basis.modes), settings)
        # Modes not let in yet are as they were at the start.
        moved = pose.coefficients[:modes] - start.coefficients[:modes]
        shape = begun + np.tensordot(moved, basis.modes[:modes], axes=1)
        matches = _match(pose.body_from_basis.apply(shape), basis, target, float(scale), settings)
        pose = _step(pose, shape, basis, modes, matches, pulls, expected, settings)
        steps.append({"iteration": float(iteration), "modes": float(modes), "matched_share": matches.share})
    fit = _as_fit(pose, basis, target, settings, tuple(steps))
    return pose, replace(fit, strangeness=expected.strangeness(pose.coefficients))


def _modes_at(iteration: int, available: int, settings: ShapeFitSettings) -> int:
    schedule = settings.modes_by_iteration
    return min(available, schedule[iteration] if iteration < len(schedule) else available)


def _match(
    vertices: np.ndarray, basis: ShapeBasis, target: Target, scale: float, settings: ShapeFitSettings
) -> _Matches:
    counted = np.flatnonzero(basis.data_weight > 0)
    normals = vertex_normals(vertices, basis.triangles)[counted]
    distance, nearest = target.tree.query(vertices[counted], distance_upper_bound=3 * scale)
    found = np.isfinite(distance)
    nearest = np.where(found, nearest, 0)
    facing = (normals * target.normals[nearest]).sum(1) > np.cos(np.deg2rad(settings.match_angle_deg))
    good = found & facing & ~target.is_border[nearest]
    index = counted[good]
    points, scan_normals = target.points[nearest[good]], target.normals[nearest[good]]
    residual = ((vertices[index] - points) * scan_normals).sum(1)
    weights = basis.data_weight[index] * (scale**2 / (scale**2 + residual**2)) ** 2
    towards_front = (basis.data_weight[counted] > 0.5) & (normals[:, 2] > 0.3)
    share = float(good[towards_front].mean()) if towards_front.any() else 0.0
    return _Matches(index, points, scan_normals, weights, share)


def _jacobian(pose: Pose, shape: np.ndarray, basis: ShapeBasis, modes: int, at: np.ndarray) -> np.ndarray:
    """(len(at), 3, 7 + modes): by log scale, rotation, translation, coefficients, at these vertices."""
    similarity = pose.body_from_basis
    turned = similarity.scale * (shape[at] @ similarity.rotation.T)
    out = np.zeros((len(at), 3, 7 + modes))
    out[:, :, 0] = turned
    x, y, z = turned.T
    out[:, 1, 1], out[:, 2, 1] = -z, y  # derivative of the cross product w x turned by w
    out[:, 0, 2], out[:, 2, 2] = z, -x
    out[:, 0, 3], out[:, 1, 3] = -y, x
    out[:, :, 4:7] = np.eye(3)
    bent = similarity.scale * (basis.modes[:modes, at] @ similarity.rotation.T)
    out[:, :, 7:] = bent.transpose(1, 2, 0)
    return out


def _step(
    pose: Pose,
    shape: np.ndarray,
    basis: ShapeBasis,
    modes: int,
    matches: _Matches,
    pulls: Mapping[LandmarkName, Pull],
    expected: Expected,
    settings: ShapeFitSettings,
) -> Pose:
    size = 7 + modes
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    vertices = pose.body_from_basis.apply(shape)
    if len(matches.vertices):
        _add_skin(
            hessian, gradient, _jacobian(pose, shape, basis, modes, matches.vertices), vertices, matches, settings
        )
    for name, pull in pulls.items():
        jacobian, place = _landmark(name, pose, shape, basis, modes)
        hessian += jacobian.T @ jacobian / pull.sigma_mm**2
        gradient += jacobian.T @ (place - pull.position) / pull.sigma_mm**2
    if expected.sternum is not None:
        (notch_jacobian, notch), (joint_jacobian, joint) = (
            _landmark(name, pose, shape, basis, modes) for name in BONE_LANDMARKS
        )
        length = float(np.linalg.norm(notch - joint))
        along = (notch - joint) / length @ (notch_jacobian - joint_jacobian)
        hessian += np.outer(along, along) / expected.sternum.sigma_mm**2
        gradient += along * (length - expected.sternum.length_mm) / expected.sternum.sigma_mm**2
    hessian[7:, 7:] += expected.precision[:modes, :modes]
    gradient[7:] += expected.precision[:modes] @ (pose.coefficients - expected.mean)
    # A whisper of damping keeps the step defined when nothing matched and no landmark pulls.
    hessian[:7, :7] += np.diag([1.0, 1.0, 1.0, 1.0, 1e-6, 1e-6, 1e-6])
    return _moved(pose, np.linalg.solve(hessian, -gradient), modes, settings)


def _landmark(
    name: LandmarkName, pose: Pose, shape: np.ndarray, basis: ShapeBasis, modes: int
) -> tuple[np.ndarray, np.ndarray]:
    """(3, 7 + modes) Jacobian and (3,) place of a landmark of the body."""
    row = LANDMARK_NAMES.index(name)
    corners, weights = basis.landmark_corners[row], basis.landmark_weights[row]
    jacobian = np.tensordot(weights, _jacobian(pose, shape, basis, modes, corners), axes=1)
    return jacobian, weights @ pose.body_from_basis.apply(shape[corners])


def _add_skin(
    hessian: np.ndarray,
    gradient: np.ndarray,
    jacobian: np.ndarray,
    vertices: np.ndarray,
    matches: _Matches,
    settings: ShapeFitSettings,
) -> None:
    error = vertices[matches.vertices] - matches.points
    weights = matches.weights * settings.effective_points / max(float(matches.weights.sum()), 1.0)
    weights = weights / settings.data_sigma_mm**2
    to_plane = np.einsum("na,nak->nk", matches.normals, jacobian)
    weighted = to_plane * weights[:, None]
    hessian += weighted.T @ to_plane
    gradient += weighted.T @ (error * matches.normals).sum(1)
    flat = jacobian.reshape(-1, jacobian.shape[2])
    weighted = flat * np.repeat(weights * settings.point_to_point**2, 3)[:, None]
    hessian += weighted.T @ flat
    gradient += weighted.T @ error.ravel()


def _moved(pose: Pose, step: np.ndarray, modes: int, settings: ShapeFitSettings) -> Pose:
    limit = settings.step_limit
    turn = step[1:4] * min(1.0, limit / max(float(np.linalg.norm(step[1:4])), 1e-12))
    old = pose.body_from_basis
    similarity = Similarity(
        old.scale * float(np.exp(np.clip(step[0], -limit, limit))),
        Rotation.from_rotvec(turn).as_matrix() @ old.rotation,
        old.translation + step[4:7],
    )
    coefficients = pose.coefficients.copy()
    coefficients[:modes] += step[7:]
    return Pose(similarity, np.clip(coefficients, -settings.coefficient_limit, settings.coefficient_limit))


def body_of(pose: Pose, basis: ShapeBasis) -> np.ndarray:
    """(n, 3) vertices of the body a pose describes."""
    return pose.body_from_basis.apply(shape_of(pose.coefficients, basis))


def shape_of(coefficients: np.ndarray, basis: ShapeBasis) -> np.ndarray:
    """(n, 3) vertices of the body that coefficients (k,) describe, in the frame and size of the basis."""
    return np.asarray(basis.mean + np.tensordot(coefficients, basis.modes, axes=1))


def _as_fit(
    pose: Pose, basis: ShapeBasis, target: Target, settings: ShapeFitSettings, steps: tuple[dict[str, float], ...]
) -> Fit:
    vertices = body_of(pose, basis)
    matches = _match(vertices, basis, target, settings.last_scale_mm * 2, settings)
    residual = ((vertices[matches.vertices] - matches.points) * matches.normals).sum(1)
    rms = float(np.sqrt(np.average(residual**2, weights=matches.weights))) if len(residual) else float("inf")
    fit = carried(Surface(vertices, basis.triangles), basis)
    return replace(fit, surface_residual_mm=rms, matched_share=matches.share, steps=steps)


def carried(body: Surface, basis: ShapeBasis, infant: float = 0.0) -> Fit:
    """A body of the basis' topology with the landmarks and areas its mesh carries.

    infant: how much of the under-fours' areas is in them, 0 to 1; the rest is the adults'.
    """
    landmarks = carry(basis.landmark_weights, basis.landmark_corners, body.vertices)
    adult, small = (carry(basis.area_weights[row], basis.area_corners[row], body.vertices) for row in (0, 1))
    return Fit(
        surface=body,
        landmarks=dict(zip(LANDMARK_NAMES, landmarks, strict=True)),
        areas=dict(zip(AREA_NAMES, infant * small + (1 - infant) * adult, strict=True)),
        surface_residual_mm=0.0,
        matched_share=0.0,
        strangeness=0.0,
    )


def sternum_mm(fit: Fit) -> float:
    """Length of the body's breastbone."""
    notch, joint = (fit.landmarks[name] for name in BONE_LANDMARKS)
    return float(np.linalg.norm(notch - joint))


def expected_scales(expected: Expected, basis: ShapeBasis, sizes: Iterable[float]) -> list[float]:
    """Scales of the expected body: these sizes, as multiples of what the expected breastbone asks for; none without."""
    if expected.sternum is None:
        return []
    body = carried(Surface(shape_of(expected.mean, basis), basis.triangles), basis)
    return [expected.sternum.length_mm / sternum_mm(body) * size for size in sizes]
