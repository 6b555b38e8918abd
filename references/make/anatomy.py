"""Where the bones and the four areas lie: anatomy tables, not a clinician's marks.

Lengths in mm, body frame (+x the patient's left, +y head, +z front). S is the sternum's length: from the
suprasternal notch (bone) to the xiphisternal joint, along the body's long axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from references.make.phenotype import Sex, median_stature

ADULT_STERNUM: dict[Sex, float] = {"male": 150.0, "female": 140.0}
"""At median stature. CT, n = 240: 149 and 136 (doi 10.16965/ijar.2019.163); three skeletons: 144 to 158."""

NEWBORN_STERNUM = 48.0
"""So that the under-fours' apex (0.58 S) lies 28 mm from a newborn's midline, as measured (Antia 1978)."""

AREA_RULE = {
    "aortic": (0.40, -0.17),
    "pulmonary": (0.40, 0.17),
    "tricuspid": (0.81, 0.22),
    "mitral": (1.06, 0.54),
    "mitral_under_four": (0.90, 0.58),
}
"""(below the notch, to the patient's left), both in S. A named rib-by-rib skeleton and the literature agree
within 10 mm: 2nd space at the right and left edge, left edge between the 4th and 5th space, apex."""

APEX_YEARS = (4.0, 5.0, 6.0, 7.0)
APEX_IN_FOURTH_SPACE = (0.92, 0.51, 0.14, 0.0)
"""Share of children whose apex beat lies in the 4th space (237 children, Nigeria; ajol njp 80131)."""


NOTCH_BELOW_CLAVICLE_JOINT = 0.0034
"""In statures, on the average man: on the neutral MakeHuman man (1,730 mm) the bone lies at y 585, the joint at y 591.
Every other body carries that man's point on the shared skin: so the navel lies 0.20 to 0.21 statures and 2.2 to 2.6 S
below the notch in both sexes at every age from one year on, as people have it. The rig's own joint lies 20-30 mm
lower in girls and women, which would put their navels at 2.05 S and their nipples at 0.8 S."""


@dataclass(frozen=True)
class Marks:
    """Points fixed to a mesh. positions: (k, 3); corners, weights: (k, 3) barycentric."""

    positions: np.ndarray
    corners: np.ndarray
    weights: np.ndarray


def sternum_mm(age_years: float, sex: Sex, stature_mm: float) -> float:
    """S of an average person.

    Adults by stature. Children from 1 year by age (CT of 1,080 Chinese children, doi 10.3892/etm.2022.11496);
    that law passes the adults' towards 18, so from 12 years on the smaller one counts. Below 1 year, where the
    straight line would give a newborn a breastbone as long as half its trunk, towards `NEWBORN_STERNUM`.
    """
    adult = ADULT_STERNUM[sex] * stature_mm / median_stature(25.0, sex)
    if age_years >= 18:
        return adult
    if age_years < 1:
        return NEWBORN_STERNUM + age_years * (_child_sternum(1.0, sex) - NEWBORN_STERNUM)
    child = _child_sternum(age_years, sex)
    return min(child, adult) if age_years >= 12 else child


def _child_sternum(age_years: float, sex: Sex) -> float:
    if sex == "male":
        return 5.616 * age_years + 60.408
    return -0.134 * age_years**2 + 6.543 * age_years + 56.805


def fourth_space_share(age_years: float) -> float:
    """How much of the under-fours' apex goes into this age's mitral area, 1 to 0."""
    if age_years < APEX_YEARS[0]:
        return 1.0
    return float(np.interp(age_years, APEX_YEARS, APEX_IN_FOURTH_SPACE))


def area_offsets(age_years: float) -> np.ndarray:
    """(4, 2) shares of S, left of the midline and headwards of the notch, in the order of AREA_NAMES."""
    share = fourth_space_share(age_years)
    grown, small = np.array(AREA_RULE["mitral"]), np.array(AREA_RULE["mitral_under_four"])
    mitral = share * small + (1 - share) * grown
    rows = np.array([AREA_RULE["aortic"], AREA_RULE["pulmonary"], AREA_RULE["tricuspid"], tuple(mitral)])
    return np.stack([rows[:, 1], -rows[:, 0]], axis=1)


def place_bones(vertices: np.ndarray, triangles: np.ndarray, notch: Marks, sternum: float) -> Marks:
    """Notch, carried by the skin, and xiphisternal joint on the midline (x = 0) of a symmetric body (n, 3)."""
    carried = np.einsum("kc,kcd->kd", notch.weights, vertices[notch.corners])
    joint = drop_on_skin(np.array([[0.0, carried[0, 1] - sternum]]), vertices, triangles)
    both = (np.concatenate(parts) for parts in zip((carried, notch.corners, notch.weights), _parts(joint), strict=True))
    return Marks(*both)


def _parts(marks: Marks) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return marks.positions, marks.corners, marks.weights


def place_areas(vertices: np.ndarray, triangles: np.ndarray, bones: np.ndarray, age_years: float) -> Marks:
    """The four areas by the rule on this body's own bones, dropped on the skin from the front.

    vertices: (n, 3); bones: (2, 3) notch and xiphisternal joint. The midline runs through both.
    """
    notch, xiphoid = bones[0, :2], bones[1, :2]
    length = np.linalg.norm(xiphoid - notch)
    up = (notch - xiphoid) / length
    left = np.array([up[1], -up[0]])
    offsets = area_offsets(age_years) * length
    return drop_on_skin(notch + offsets[:, :1] * left + offsets[:, 1:] * up, vertices, triangles)


def drop_on_skin(places: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> Marks:
    """Frontal places (k, 2) met from the front along -z. Raises ValueError where there is no skin."""
    marks = [_frontmost(place, vertices, triangles) for place in places]
    corners, weights = np.array([mark[0] for mark in marks]), np.array([mark[1] for mark in marks])
    return Marks(np.einsum("kc,kcd->kd", weights, vertices[corners]), corners, weights)


def _frontmost(place: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    e, f, p = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2], place - a[:, :2]
    area = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
    safe = np.where(np.abs(area) > 1e-9, area, np.inf)
    v = (p[:, 0] * f[:, 1] - p[:, 1] * f[:, 0]) / safe
    w = (e[:, 0] * p[:, 1] - e[:, 1] * p[:, 0]) / safe
    weights = np.stack([1 - v - w, v, w], axis=1)
    met = np.flatnonzero((weights >= -1e-9).all(axis=1) & (area > 1e-9))
    if len(met) == 0:
        raise ValueError(f"no skin in front of {np.round(place, 1)}")
    heights = np.einsum("kc,kc->k", weights[met], vertices[triangles[met], 2])
    best = met[heights.argmax()]
    return triangles[best], weights[best]
