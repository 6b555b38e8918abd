from dataclasses import replace

import numpy as np
import pytest

from lubdub.judging import reasons
from lubdub.judging.verdict import Evidence, judge
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Landmark, Located, Patient

GIVEN = {name: Landmark(np.zeros(3), "given", 5.0) for name in LANDMARK_NAMES}
SUGGESTED = {name: Landmark(np.zeros(3), "suggested", 15.0) for name in LANDMARK_NAMES}
FINE = Evidence(
    located=Located({}, None, (), None, {"rule_disagreement_mm": 8.0, "surface_residual_mm": 1.5}),
    method="lubdub",
    patient=Patient(40, "male"),
    landmarks=GIVEN,
    gaps_mm=dict.fromkeys(AREA_NAMES, 2.0),
    coverage=0.95,
    rise=0.28,
    size=1.0,
)


def measured(**measures: float) -> Evidence:
    return replace(FINE, located=replace(FINE.located, measures={**FINE.located.measures, **measures}))


def test_a_good_scan_with_all_points_is_shown() -> None:
    assert judge(FINE, ()) == ("show", ())


@pytest.mark.parametrize(
    ("evidence", "reason"),
    [
        (replace(FINE, gaps_mm={**FINE.gaps_mm, "mitral": 30.0}), reasons.AREA_NOT_SCANNED),
        (replace(FINE, coverage=0.3), reasons.CHEST_NOT_IN_SCAN),
        (replace(measured(fitted_skin_share=0.7), landmarks=SUGGESTED), reasons.CHEST_NOT_MATCHED),
        (replace(measured(sternum_of_expected=0.72), landmarks=SUGGESTED), reasons.AGE_AND_SIZE),
        (replace(measured(sternum_of_expected=1.4), landmarks=SUGGESTED), reasons.AGE_AND_SIZE),
        (replace(FINE, rise=0.11), reasons.LOOKS_LIKE_A_BACK),
        (measured(surface_residual_mm=14.0), reasons.FIT_FAILED),
        (measured(rule_disagreement_mm=95.0), reasons.STRONG_DISAGREEMENT),
        (replace(FINE, patient=Patient(30, "female", "sitting")), reasons.SITTING_WOMAN),
        (replace(FINE, patient=Patient(30, None, "sitting")), reasons.SITTING_WOMAN),
    ],
    ids=lambda value: getattr(value, "code", "evidence"),
)
def test_what_makes_us_refuse(evidence: Evidence, reason: object) -> None:
    verdict, why = judge(evidence, ())
    assert verdict == "refuse"
    assert why[0] == reason


def test_a_reason_to_refuse_is_not_said_again_as_a_care() -> None:
    codes = [one.code for one in judge(replace(measured(sternum_of_expected=0.5), landmarks=SUGGESTED), ())[1]]
    assert codes.count("age_and_size") == 1


@pytest.mark.parametrize("measures", [{"fitted_skin_share": 0.7}, {"sternum_of_expected": 0.72}], ids=str)
def test_both_bones_marked_outweigh_what_the_skin_alone_would_be_refused_for(measures: dict[str, float]) -> None:
    assert judge(measured(**measures), ()) == ("show", ())


@pytest.mark.parametrize(
    ("evidence", "reason"),
    [
        (replace(FINE, landmarks=SUGGESTED), reasons.LANDMARKS_SUGGESTED),
        (
            replace(FINE, landmarks={**GIVEN, "xiphisternum": SUGGESTED["xiphisternum"]}),
            reasons.LOWER_END_NOT_GIVEN,
        ),
        (
            replace(FINE, landmarks={**GIVEN, "suprasternal_notch": SUGGESTED["suprasternal_notch"]}),
            reasons.NOTCH_NOT_GIVEN,
        ),
        (replace(FINE, landmarks={**SUGGESTED, "navel": GIVEN["navel"]}), reasons.BONES_NOT_GIVEN),
        (measured(rule_disagreement_mm=75.0), reasons.DISAGREEMENT),
        (measured(landmark_strain=3.5), reasons.DISAGREEMENT),
        (replace(FINE, patient=Patient(None, "male")), reasons.AGE_MISSING),
        (replace(FINE, patient=Patient(6, "female", "sitting")), reasons.SITTING),
        (replace(FINE, coverage=0.6), reasons.THIN_COVERAGE),
        (measured(surface_residual_mm=7.0), reasons.ROUGH_SURFACE),
        (measured(strangeness=0.6), reasons.ODD_SHAPE),
        (measured(folded_share=0.05), reasons.ODD_SHAPE),
        (measured(sternum_of_expected=0.6), reasons.AGE_AND_SIZE),
        (measured(sternum_of_expected=1.5), reasons.AGE_AND_SIZE),
        (replace(FINE, method="paper"), reasons.PAPER_METHOD),
    ],
    ids=lambda value: getattr(value, "code", "evidence"),
)
def test_what_makes_us_show_with_care(evidence: Evidence, reason: object) -> None:
    assert judge(evidence, ()) == ("show_with_care", (reason,))


def test_a_child_is_judged_by_its_own_size() -> None:
    child = replace(FINE, gaps_mm=dict.fromkeys(AREA_NAMES, 14.0), size=0.5)
    assert judge(child, ())[0] == "refuse"
    assert judge(replace(child, size=1.0), ())[0] == "show"


def test_a_warning_from_earlier_is_never_forgotten() -> None:
    assert judge(FINE, (reasons.ODD_SHAPE,)) == ("show_with_care", (reasons.ODD_SHAPE,))


def test_a_flat_chest_is_shown_with_care_and_an_unknown_rise_says_nothing() -> None:
    verdict, why = judge(replace(FINE, rise=0.12), ())
    assert (verdict, why) == ("show_with_care", (reasons.FLAT_CHEST,))
    assert judge(replace(FINE, rise=None), ())[0] == "show"


def test_a_back_that_rises_a_little_but_fits_badly_is_shown_with_care() -> None:
    badly = measured(surface_residual_mm=2.4)
    assert judge(replace(badly, rise=0.19), ())[1] == (reasons.FLAT_CHEST,)
    assert judge(replace(badly, rise=0.28), ())[0] == "show"
