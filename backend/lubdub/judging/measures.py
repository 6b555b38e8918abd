"""Numbers about a result that say whether it can be trusted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.surface import Surface, triangle_normals
from lubdub.results import BONE_LANDMARKS, CleanScan, Fit, LandmarkName, Landmarks, Patient


@dataclass(frozen=True)
class StrainSettings:
    """How far good clicks lie from the fitted body's own points: a share of the breastbone, and the click itself.

    Root mean square over 160 simulated people: notch 0.11 and lower end 0.12 (bones do not follow skin), navel and
    nipples 0.06 with the click; nipples of women after puberty 0.18.
    """

    notch_share: float = 0.11
    joint_share: float = 0.12
    seen_share: float = 0.06
    breast_share: float = 0.18
    bone_click_mm: float = 6.0
    seen_click_mm: float = 5.0

    def expected_mm(self, name: LandmarkName, patient: Patient, sternum_mm: float) -> float:
        """One standard deviation (3D) of a click from the fitted body's own point."""
        if name in BONE_LANDMARKS:
            share = self.notch_share if name == "suprasternal_notch" else self.joint_share
            return float(np.hypot(share * sternum_mm, self.bone_click_mm))
        slides = patient.may_have_breasts and name.startswith("nipple")
        return float(np.hypot((self.breast_share if slides else self.seen_share) * sternum_mm, self.seen_click_mm))


def folded_share(before: Surface, after: Surface) -> float:
    """Share of a body's triangles that a deformation of it turned over: none where the skin was only bent."""
    turned = triangle_normals(before.vertices, before.triangles) * triangle_normals(after.vertices, after.triangles)
    return float((turned.sum(axis=1) < 0).mean())


def chest_coverage(scan: CleanScan, places: np.ndarray, size: float) -> float:
    """Share of the chest's front, around the breastbone and the four places, that has scanned skin.

    places: (k, 3) points of the chest, body frame: the areas and the bone points; size: share of an adult's
    breastbone. A grid of 8 mm cells (scaled) over their frontal rectangle, counted when skin lies within one
    chestpiece's radius.
    """
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    step = 8.0 * size
    grid = np.stack(np.meshgrid(*(np.arange(a, b + step, step) for a, b in zip(low, high, strict=True))), axis=-1)
    facing = scan.points[scan.normals[:, 2] > 0.1]
    if not len(facing):
        return 0.0
    distance = cKDTree(facing[:, :2]).query(grid.reshape(-1, 2))[0]
    return float(np.mean(distance < 12.0 * size))


def fitted_skin_share(scan: CleanScan, fit: Fit, sternum_mm: float) -> float:
    """Share of the fitted body's chest that lies on scanned skin, on the side that has less of it.

    scan and fit in the body frame, mm. The chest: what faces the front within one breastbone's length of the midline,
    from the notch to 1.3 lengths below it; on skin: within 0.03 lengths and 5 mm of a scanned point. A body that is
    laid into a scan wrongly, or into half a chest, leaves some of its own chest in the air.
    """
    vertices, normals = fit.surface.vertices, fit.surface.normals
    across, along, _ = ((vertices - fit.landmarks["suprasternal_notch"]) / sternum_mm).T
    is_chest = (along < 0) & (along > -1.3) & (np.abs(across) < 1) & (normals[:, 2] > 0.3)
    is_on_skin = cKDTree(scan.points).query(vertices[is_chest])[0] < 0.03 * sternum_mm + 5.0
    sides = (is_on_skin[across[is_chest] > 0], is_on_skin[across[is_chest] < 0])
    return min(float(side.mean()) if len(side) else 0.0 for side in sides)


def chest_rise(scan: CleanScan, landmarks: Landmarks) -> float | None:
    """How much the skin rises to the front from the notch to two thirds down the breastbone, in its lengths.

    `verdict.Gates` says how much fronts and backs rise. Depth is the median of the skin within 0.12 lengths.
    None without both bone points or skin there.
    """
    if not all(name in landmarks for name in BONE_LANDMARKS):
        return None
    notch, joint = (landmarks[name].position for name in BONE_LANDMARKS)
    length = float(np.linalg.norm(notch - joint))
    facing = scan.points[scan.normals[:, 2] > 0]
    if length == 0 or not len(facing):
        return None
    depths = []
    for place in (notch, notch + (joint - notch) * 2 / 3):
        near = np.linalg.norm(facing[:, :2] - place[:2], axis=1) < 0.12 * length
        if not near.any():
            return None
        depths.append(float(np.median(facing[near, 2])))
    return (depths[1] - depths[0]) / length


def landmark_residual(fit: Fit, landmarks: Landmarks) -> dict[str, float]:
    """`landmark_residual_mm`: root mean square distance from clicked landmarks to the body's own; empty without."""
    clicked = [name for name, landmark in landmarks.items() if landmark.is_marked]
    if not clicked:
        return {}
    offsets = [fit.landmarks[name] - landmarks[name].position for name in clicked]
    return {"landmark_residual_mm": float(np.sqrt(np.mean(np.sum(np.square(offsets), axis=1))))}


def landmark_strain(
    fit: Fit, landmarks: Landmarks, patient: Patient, sternum_mm: float, settings: StrainSettings | None = None
) -> dict[str, float]:
    """`landmark_strain`: the clicked landmark farthest from the body's own, in what good clicks differ by."""
    settings = settings or StrainSettings()
    strains = [
        float(np.linalg.norm(fit.landmarks[name] - landmark.position)) / settings.expected_mm(name, patient, sternum_mm)
        for name, landmark in landmarks.items()
        if landmark.is_marked
    ]
    return {"landmark_strain": max(strains)} if strains else {}
