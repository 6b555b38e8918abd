"""Made-up bodies as references and clean scans, for tests of the rooms that come after cleaning."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface, unit
from lubdub.results import CleanScan, Landmark, Landmarks, Reference, Unit
from tests.bodies import Shape, areas_of, landmarks_of, torso_surface

STILL = Similarity.identity()


def reference_of(name: str, shape: Shape, columns: int = 44, rows: int = 42) -> Reference:
    """A body as a reference, as coarse as the real ones."""
    card = {"age_years": 30.0, "sex": "male"}
    return Reference(name, torso_surface(shape, columns, rows), landmarks_of(shape), areas_of(shape), card)


def seen_from_front(shape: Shape, columns: int = 130, rows: int = 120) -> Surface:
    """What a camera in front of a body sees, chin to hip."""
    whole = torso_surface(shape, columns, rows)
    y = whole.vertices[:, 1] / shape.size
    return whole.kept((whole.normals[:, 2] > 0.2) & (y < 30) & (y > -440))


def clean_scan(surface: Surface, moved: Similarity = STILL, noise_mm: float = 0.0, seed: int = 3) -> CleanScan:
    """A surface seen from the front as the cleaning would hand it on, then moved as one."""
    points = surface.vertices + noise_mm * np.random.default_rng(seed).standard_normal(surface.vertices.shape)
    y = points[:, 1]
    rim = 0.03 * np.ptp(y)
    on_rim = (y > y.max() - rim) | (y < y.min() + rim) | (unit(surface.normals)[:, 2] < 0.35)
    return CleanScan(
        points=moved.apply(points),
        normals=moved.turn(surface.normals),
        is_border=on_rim,
        drape=lambda: Surface(moved.apply(points), surface.triangles),
        body_from_file=Similarity.identity(),
        unit=Unit("mm", 1.0, "given"),
    )


def clicked(shape: Shape, moved: Similarity = STILL) -> Landmarks:
    """The five landmarks, clicked exactly."""
    return {name: Landmark(moved.apply(place), "given", 3.0) for name, place in landmarks_of(shape).items()}


def motion(degrees: float, axis: tuple[float, float, float], shift: tuple[float, float, float]) -> Similarity:
    """A turn about an axis through the origin, then a shift in mm."""
    turn = Rotation.from_rotvec(np.deg2rad(degrees) * unit(np.array(axis, float)))
    return Similarity(1.0, turn.as_matrix(), np.array(shift, float))


def degrees_apart(first: Similarity, second: Similarity) -> float:
    """The angle between two turns."""
    between = Rotation.from_matrix(first.rotation.T @ second.rotation)
    return float(np.rad2deg(between.magnitude()))
