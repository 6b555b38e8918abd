"""May we show this? Numbers in, verdict and reasons out. Refusing is better than guessing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lubdub.judging import reasons
from lubdub.results import (
    BONE_LANDMARKS,
    AreaName,
    LandmarkName,
    Landmarks,
    Located,
    MethodName,
    Patient,
    Reason,
    VerdictWord,
)


@dataclass(frozen=True)
class Gates:
    """Limits of the numbers; each a length in mm for an adult unless said, scaled by the breastbone for children."""

    skin_gap_refuse_mm: float = 20.0
    """No skin this close to an area's place: half a chestpiece."""
    rise_refuse: float = 0.12
    rise_care: float = 0.14
    rise_care_per_residual: float = 0.09
    """Rise of the chest from the notch downwards, see `measures.chest_rise`, and by how much more it must be for each
    mm of skin residual, up to `residual_trusted_mm`: a back clicked as a front rises less (0.04-0.16 in 13 of 14) and
    fits worse (1.3-2.7 mm) than a front (0.145 or more in 65 of 65, 0.8-2.2 mm). 0.08 let most backs pass with care."""
    residual_trusted_mm: float = 2.5
    coverage_refuse: float = 0.45
    coverage_care: float = 0.7
    """Share of the chest around the areas and the notch that has skin, see `measures.chest_coverage`; whole one-sided
    scans reach 0.8-1."""
    fitted_skin_refuse: float = 0.75
    """Share of the fitted chest that lies on skin, see `measures.fitted_skin_share`: 0.76 or more in 423 of 423 good
    scans without both bones, 0.74 or less in 74 of 76 halves of chests that no other limit refused."""
    residual_care_mm: float = 5.0
    residual_refuse_mm: float = 12.0
    """Skin residual: 1.0-1.5 mm on real anatomies, 3 mm with a coarse phone mesh."""
    sternum_of_expected_care: tuple[float, float] = (0.7, 1.35)
    """Breastbone over what the age lets one expect: people differ by 8 %, clicks by 6 %."""
    sternum_of_expected_refuse: tuple[float, float] = (0.75, 1.35)
    """The same where no bone was marked, and so nothing but the fit says how long it is: 0.82-1.13 in 348 good scans,
    0.64-0.77 in most that were laid wrongly."""
    strangeness_care: float = 0.5
    """Root mean square coefficient against what was expected: 0.3 at most in 80 simulated people, whether their age was
    said or not, and in a modelled woman of another origin."""
    folded_care: float = 0.03
    """Triangles of the body that its last bendings turned over: 0.011 at most in 80 simulated people."""
    disagreement_care_mm: float = 70.0
    disagreement_refuse_mm: float = 90.0
    """Rule against registration, worst area: skin and clicks do not hear each other, and good scans differ by 27 mm at
    most in 90 of 100, by 43 mm in 97, by 65 mm in 160 of 160."""
    landmark_strain_care: float = 3.2
    """Worst click against the fitted body's own point, see `measures.landmark_strain`: 1.9 at most in 95 of
    100 good scans, 2.7 in 99, 3.1 in 160 of 160; clicks 60 to 150 mm off had 1.8 (a nipple) to 7, most over 3.6."""


@dataclass(frozen=True)
class Evidence:
    """What the judge looks at. gaps_mm: area -> distance from its place to the nearest skin; rise: `chest_rise`."""

    located: Located
    method: MethodName
    patient: Patient
    landmarks: Landmarks
    gaps_mm: Mapping[AreaName, float]
    coverage: float
    rise: float | None
    size: float
    """Breastbone length as a share of an adult's 150 mm."""


def judge(
    evidence: Evidence, warnings: tuple[Reason, ...], gates: Gates | None = None
) -> tuple[VerdictWord, tuple[Reason, ...]]:
    """The verdict and every reason for it, the gravest first. warnings: what earlier rooms found odd."""
    gates = gates or Gates()
    refusals = _refusals(evidence, gates)
    cares = (*warnings, *_cares(evidence, gates))
    if refusals:
        return "refuse", tuple(dict.fromkeys((*refusals, *cares)))
    return ("show_with_care" if cares else "show"), cares


def _refusals(evidence: Evidence, gates: Gates) -> tuple[Reason, ...]:
    measures, patient, size = evidence.located.measures, evidence.patient, evidence.size
    bones = _given(evidence) & set(BONE_LANDMARKS)
    is_in_the_air = measures.get("fitted_skin_share", 1.0) < gates.fitted_skin_refuse
    checks = (
        (max(evidence.gaps_mm.values()) > gates.skin_gap_refuse_mm * size, reasons.AREA_NOT_SCANNED),
        (_flatter_than(evidence, gates.rise_refuse), reasons.LOOKS_LIKE_A_BACK),
        (evidence.coverage < gates.coverage_refuse, reasons.CHEST_NOT_IN_SCAN),
        (is_in_the_air and len(bones) < 2, reasons.CHEST_NOT_MATCHED),
        (not bones and not _suits_the_age(measures, gates.sternum_of_expected_refuse), reasons.AGE_AND_SIZE),
        (measures.get("surface_residual_mm", 0.0) > gates.residual_refuse_mm * size, reasons.FIT_FAILED),
        (
            measures.get("rule_disagreement_mm", 0.0) > gates.disagreement_refuse_mm * size,
            reasons.STRONG_DISAGREEMENT,
        ),
        (_sits_with_breasts(patient), reasons.SITTING_WOMAN),
    )
    return tuple(reason for holds, reason in checks if holds)


def _cares(evidence: Evidence, gates: Gates) -> tuple[Reason, ...]:
    measures, patient, size = evidence.located.measures, evidence.patient, evidence.size
    given = _given(evidence)
    checks = (
        (not given, reasons.LANDMARKS_SUGGESTED),
        (bool(given) and not given & set(BONE_LANDMARKS), reasons.BONES_NOT_GIVEN),
        ("suprasternal_notch" not in given and "xiphisternum" in given, reasons.NOTCH_NOT_GIVEN),
        ("xiphisternum" not in given and "suprasternal_notch" in given, reasons.LOWER_END_NOT_GIVEN),
        (_flatter_than(evidence, _least_rise(measures, gates)), reasons.FLAT_CHEST),
        (_disagree(measures, gates, size), reasons.DISAGREEMENT),
        (patient.age_years is None, reasons.AGE_MISSING),
        (not _suits_the_age(measures, gates.sternum_of_expected_care), reasons.AGE_AND_SIZE),
        (patient.posture == "sitting" and not _sits_with_breasts(patient), reasons.SITTING),
        (evidence.coverage < gates.coverage_care, reasons.THIN_COVERAGE),
        (measures.get("surface_residual_mm", 0.0) > gates.residual_care_mm * size, reasons.ROUGH_SURFACE),
        (_is_odd(measures, gates), reasons.ODD_SHAPE),
        (evidence.method == "paper", reasons.PAPER_METHOD),
    )
    return tuple(reason for holds, reason in checks if holds)


def _given(evidence: Evidence) -> set[LandmarkName]:
    return {name for name, landmark in evidence.landmarks.items() if landmark.is_marked}


def _flatter_than(evidence: Evidence, limit: float) -> bool:
    return evidence.rise is not None and evidence.rise < limit


def _least_rise(measures: Mapping[str, float], gates: Gates) -> float:
    residual = min(measures.get("surface_residual_mm", 0.0), gates.residual_trusted_mm)
    return max(gates.rise_care, gates.rise_care_per_residual * residual)


def _suits_the_age(measures: Mapping[str, float], limits: tuple[float, float]) -> bool:
    """Whether the breastbone is about as long as the age lets one expect; true when nothing is expected."""
    return limits[0] <= measures.get("sternum_of_expected", 1.0) <= limits[1]


def _is_odd(measures: Mapping[str, float], gates: Gates) -> bool:
    strange = measures.get("strangeness", 0.0) > gates.strangeness_care
    return strange or measures.get("folded_share", 0.0) > gates.folded_care


def _disagree(measures: Mapping[str, float], gates: Gates, size: float) -> bool:
    by_rule = measures.get("rule_disagreement_mm", 0.0) > gates.disagreement_care_mm * size
    return by_rule or measures.get("landmark_strain", 0.0) > gates.landmark_strain_care


def _sits_with_breasts(patient: Patient) -> bool:
    return patient.posture == "sitting" and patient.may_have_breasts
