import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.landmarks.suggest import suggest
from lubdub.results import LANDMARK_NAMES, Fit
from tests.bodies import torso_scan
from tests.scanned import clean_scan

BODY = torso_scan()
SCAN = clean_scan(BODY.surface, np.array([0.0, 0.0, 1.0]))


def fit(lift_mm: float = 0.0, size: float = 1.0) -> Fit:
    landmarks = {name: (place + [0.0, 0.0, lift_mm]) * size for name, place in BODY.landmarks.items()}
    return Fit(Surface(np.eye(3), np.array([[0, 1, 2]])), landmarks, {}, 1.0, 1.0, 0.5)


def test_all_five_are_suggested_on_the_scanned_skin() -> None:
    suggested = suggest(SCAN, fit(lift_mm=7.0))
    assert set(suggested) == set(LANDMARK_NAMES)
    for mark in suggested.values():
        assert mark.source == "suggested"
        assert np.linalg.norm(SCAN.points - mark.position, axis=1).min() == 0


def test_a_body_that_floats_above_the_skin_is_less_sure() -> None:
    close, floating = suggest(SCAN, fit()), suggest(SCAN, fit(lift_mm=25.0))
    assert all(floating[name].uncertainty_mm > close[name].uncertainty_mm for name in LANDMARK_NAMES)


def test_the_lower_end_of_the_breastbone_is_the_least_sure() -> None:
    suggested = suggest(SCAN, fit())
    others = [mark.uncertainty_mm for name, mark in suggested.items() if name != "xiphisternum"]
    assert max(others) < suggested["xiphisternum"].uncertainty_mm
