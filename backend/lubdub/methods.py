"""Three ways from a clean scan with landmarks to the four areas, behind one interface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.areas.anatomy import sternum_length_mm
from lubdub.areas.bones import believe
from lubdub.areas.rule import Breastbone, distance_mm, place_areas
from lubdub.fitting.paper import fit_paper
from lubdub.fitting.shape import Pose
from lubdub.judging.measures import fitted_skin_share, folded_share, landmark_residual, landmark_strain
from lubdub.library.choose import choose
from lubdub.library.nearest import rank_by_shape
from lubdub.results import (
    BONE_LANDMARKS,
    AreaName,
    CleanScan,
    Estimate,
    Fit,
    LandmarkName,
    Landmarks,
    Library,
    Located,
    MethodName,
    Patient,
    Progress,
    Reference,
)


@dataclass(frozen=True)
class Chest:
    """What every method is given: the skin in the body frame, all landmarks, the person.

    landmarks: all five, given or suggested. fit: the shape basis bent onto the scan; always there for `lubdub`,
    otherwise only when landmarks had to be suggested. pose: the state that fit ended in. overlay: the same body
    laid exactly on the skin, near the clicks and with the believed breastbone; for showing, since it follows the
    clicks and so cannot contradict them. age_years: as said, or read off the breastbone.
    """

    scan: CleanScan
    landmarks: Landmarks
    patient: Patient
    age_years: float
    fit: Fit | None = None
    pose: Pose | None = None
    overlay: Fit | None = None

    @property
    def marked(self) -> Landmarks:
        """The landmarks that a person or a sticker gave."""
        return {name: landmark for name, landmark in self.landmarks.items() if landmark.is_marked}

    def notch(self, fit: Fit | None) -> np.ndarray:
        """(3,) marked or suggested; else as a method's own fit has it. Raises ValueError when nothing says it."""
        if "suprasternal_notch" in self.landmarks:
            return self.landmarks["suprasternal_notch"].position
        if fit is None:
            raise ValueError("nothing says where the notch is")
        return fit.landmarks["suprasternal_notch"]

    def breastbone(self) -> Breastbone:
        """As clicks and fitted body say together; they are two witnesses. Raises ValueError without a fitted body."""
        if self.fit is None:
            raise ValueError("this needs a fitted body")
        return believe(self.marked, self.fit.landmarks, self.patient)


Method = Callable[[Chest, Library, Progress], Located]


def by_rule(chest: Chest, library: Library, progress: Progress) -> Located:
    """The anatomy table on the breastbone's two ends: no registration. The baseline that others must beat."""
    bone = believe(chest.landmarks, {}, chest.patient)
    return Located(place_areas(bone, chest.age_years), None, (), None, {"sternum_mm": bone.length_mm})


def by_paper(chest: Chest, library: Library, progress: Progress) -> Located:
    """FPFH, RANSAC and ICP to every reference, the least Chamfer distance, then landmark-guided N-ICP."""
    choice = choose(chest.scan, chest.landmarks, library.references)
    progress("choose", 0.75)
    fit = fit_paper(chest.scan, chest.landmarks, choice.selected, choice.start)
    length = float(fit.landmarks["suprasternal_notch"][1] - fit.landmarks["xiphisternum"][1])
    areas = {name: Estimate(place, _carried_sigma(choice.selected, name, length)) for name, place in fit.areas.items()}
    measures = {"surface_residual_mm": fit.surface_residual_mm, "sternum_mm": length}
    measures |= _against_rule(chest, fit.areas) | landmark_residual(fit, chest.landmarks)
    return Located(areas, fit, choice.ranked, choice.selected.id, measures, choice.notes)


def by_lubdub(chest: Chest, library: Library, progress: Progress) -> Located:
    """Bone first: the rule on bone points believed from clicks and fitted body together."""
    if chest.fit is None or chest.overlay is None:
        raise ValueError("this method needs a fitted body")
    bone = chest.breastbone()
    areas = place_areas(bone, chest.age_years)
    ranked = rank_by_shape(chest.fit.surface, library.references)
    measures = {
        "surface_residual_mm": chest.fit.surface_residual_mm,
        "strangeness": chest.fit.strangeness,
        "fitted_skin_share": fitted_skin_share(chest.scan, chest.fit, bone.length_mm),
        "folded_share": folded_share(chest.fit.surface, chest.overlay.surface),
        "sternum_mm": bone.length_mm,
        **_against_age(bone, chest.patient),
        "rule_disagreement_mm": _disagreement(areas, chest.fit, chest.age_years),
        "spread_mm": _spread_mm(areas, chest.overlay.areas),
        **landmark_residual(chest.fit, chest.landmarks),
        **landmark_strain(chest.fit, chest.landmarks, chest.patient, bone.length_mm),
    }
    return Located(areas, chest.overlay, ranked, ranked[0].id if ranked else None, measures)


METHODS: Mapping[MethodName, Method] = {"lubdub": by_lubdub, "paper": by_paper, "rule": by_rule}

PAPER_SIGMA = np.array([0.08, 0.11])
"""Error of areas carried by skin alone, in shares of the breastbone: 14 mm on a real man from CT (S = 158)."""


def _carried_sigma(reference: Reference, name: AreaName, length: float) -> np.ndarray:
    """(2,) mm: of areas carried by skin, and of the two who marked this one, each half their distance from its place.

    length: of the fitted breastbone. People who disagree make a region larger; that they agree proves nothing yet.
    """
    notch, joint = (reference.landmarks[bone] for bone in BONE_LANDMARKS)
    grown = length / float(notch[1] - joint[1])
    return np.hypot(PAPER_SIGMA * length, reference.spread_mm.get(name, 0.0) / 2 * grown)


def _disagreement(areas: Mapping[AreaName, Estimate], fit: Fit, age_years: float) -> float:
    """How far the rule on the fitted body's own bones lies from the answer: a registration against a ruler."""
    sure = np.zeros((2, 2))
    own = Breastbone(fit.landmarks["suprasternal_notch"], fit.landmarks["xiphisternum"], sure, sure)
    return distance_mm(_positions(areas), _positions(place_areas(own, age_years)))


def _against_age(bone: Breastbone, patient: Patient) -> dict[str, float]:
    """`sternum_of_expected`: the breastbone's length over the one that age and sex let one expect."""
    if patient.age_years is None:
        return {}
    return {"sternum_of_expected": bone.length_mm / sternum_length_mm(patient.age_years, patient.sex)}


def _against_rule(chest: Chest, areas: Mapping[AreaName, np.ndarray]) -> dict[str, float]:
    """The same for areas carried by a mesh, when the bones were clicked."""
    if not all(name in chest.marked for name in BONE_LANDMARKS):
        return {}
    rule = place_areas(believe(chest.marked, {}, chest.patient), chest.age_years)
    return {"rule_disagreement_mm": distance_mm(_positions(rule), areas)}


def _spread_mm(areas: Mapping[AreaName, Estimate], carried: Mapping[AreaName, np.ndarray]) -> float:
    offsets = [(areas[name].position - carried[name])[:2] for name in areas]
    return float(np.sqrt(np.mean(np.sum(np.square(offsets), axis=1))))


def _positions(areas: Mapping[AreaName, Estimate]) -> dict[AreaName, np.ndarray]:
    return {name: estimate.position for name, estimate in areas.items()}


NEEDED: Mapping[MethodName, tuple[LandmarkName, ...]] = {
    "lubdub": (),
    "paper": ("navel", "nipple_left", "nipple_right"),
    "rule": BONE_LANDMARKS,
}
"""Landmarks a method cannot do without; missing ones are suggested first, from a shape fit."""
