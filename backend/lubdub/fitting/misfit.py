"""How badly a body and a scan explain each other: what tells a wrong turn or size from the right one."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from lubdub.fitting.expected import Expected
from lubdub.fitting.shape import Pose, Target, body_of, sternum_mm
from lubdub.geometry.surface import vertex_normals
from lubdub.results import Fit, ShapeBasis


def misfit_mm(pose: Pose, basis: ShapeBasis, target: Target, limit: float, expected: Expected) -> float:
    """How badly body and scan explain each other, both ways, each distance capped at 4 x limit (mm).

    The body's far side is left out when the scan is one-sided; three tenths of the scan may be arms or clutter; an odd
    shape counts against itself. Scan that no body explains counts as much as body without a scan: when it counted half,
    a body too small was hardly worse, and of 77 simulated small children, unmarked, one was shown a third of its length
    out of place.
    """
    cap = 4 * limit
    vertices = body_of(pose, basis)
    normals = vertex_normals(vertices, basis.triangles)
    outward = target.normals.mean(axis=0)
    used = basis.data_weight > 0.3
    if np.linalg.norm(outward) > 0.3:
        used &= normals @ outward > 0.2 * float(np.linalg.norm(outward))
    if not used.any():
        return 3 * cap
    # Nothing is looked for beyond the cap: a wrong turn's neighbours are far away, and slow to find.
    distance, nearest = target.tree.query(vertices[used], distance_upper_bound=cap)
    found = np.isfinite(distance)
    there = np.full(len(distance), cap)
    right_way = (normals[used][found] * target.normals[nearest[found]]).sum(1) >= 0.3
    there[found] = np.where(right_way, distance[found], cap)
    some = target.points[:: max(1, len(target.points) // 3000)]
    back = np.sort(np.minimum(cKDTree(vertices).query(some, distance_upper_bound=cap)[0], cap))
    strangeness = expected.strangeness(pose.coefficients)
    return float(there.mean() + back[: int(0.7 * len(back))].mean() + 2.0 * strangeness)


def with_surprise(misfit: float, fit: Fit, expected: Expected, unlikely: float) -> float:
    """The misfit, more for an unexpected size. unlikely: what each standard deviation of surprise costs, as a share."""
    return misfit * (1 + unlikely * expected.sternum.surprise(sternum_mm(fit))) if expected.sternum else misfit
