from dataclasses import replace

import numpy as np
import pytest

from lubdub.geometry.surface import Surface
from lubdub.judging.measures import (
    chest_coverage,
    chest_rise,
    fitted_skin_share,
    folded_share,
    landmark_residual,
    landmark_strain,
)
from lubdub.results import LANDMARK_NAMES, Fit, Landmark, LandmarkName, Patient
from tests.bodies import hide_side, torso_scan
from tests.scanned import clean_scan

BODY = torso_scan()
PLACES = np.array([*BODY.areas.values(), BODY.landmarks["suprasternal_notch"]])
FRONT = np.array([0.0, 0.0, 1.0])


def test_a_whole_front_covers_the_chest() -> None:
    assert chest_coverage(clean_scan(BODY.surface, FRONT), PLACES, 1.0) == 1.0


def test_half_a_chest_is_half_a_coverage() -> None:
    right = BODY.surface.kept(BODY.surface.vertices[:, 0] < np.median(PLACES[:, 0]))
    half = chest_coverage(clean_scan(right, FRONT, count=4000), PLACES, 1.0)
    assert 0.2 < half < 0.8


def fitted(surface: Surface) -> Fit:
    return Fit(surface, BODY.landmarks, {}, 1.0, 1.0, 0.2)


def test_a_body_fitted_to_a_whole_chest_lies_on_its_skin() -> None:
    assert fitted_skin_share(clean_scan(BODY.surface, FRONT, count=20_000), fitted(BODY.surface), 150.0) == 1.0


@pytest.mark.parametrize("side", [1, -1])
def test_half_a_chest_leaves_the_other_half_of_the_fitted_body_in_the_air(side: int) -> None:
    half = BODY.surface.kept(side * BODY.surface.vertices[:, 0] > 0)
    assert fitted_skin_share(clean_scan(half, FRONT, count=4000), fitted(BODY.surface), 150.0) < 0.2


def test_a_back_covers_nothing() -> None:
    back = hide_side(BODY, (0, 0, -1)).surface
    assert chest_coverage(clean_scan(back, -FRONT), PLACES, 1.0) == 0.0


def test_bent_skin_is_not_folded_and_a_corner_drawn_across_its_opposite_edge_is() -> None:
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    bent, folded = flat.copy(), flat.copy()
    bent[1, 2], folded[1] = 0.8, [0.2, 0.8, 0.0]
    assert folded_share(Surface(flat, triangles), Surface(bent, triangles)) == 0.0
    assert folded_share(Surface(flat, triangles), Surface(folded, triangles)) == 0.5


def marks(scale: float = 1.0) -> dict[str, Landmark]:
    return {name: Landmark(place * scale, "given", 5.0) for name, place in BODY.landmarks.items()}


def test_a_front_rises_below_the_notch_and_the_same_at_every_size() -> None:
    rise = chest_rise(clean_scan(BODY.surface, FRONT), marks())
    assert rise is not None
    small = Surface(BODY.surface.vertices * 0.5, BODY.surface.triangles)
    assert chest_rise(clean_scan(small, FRONT), marks(0.5)) == pytest.approx(rise, abs=0.02)


def test_a_tilted_plane_rises_by_its_slope() -> None:
    slope = 0.25
    x, y = np.meshgrid(np.arange(-100.0, 101, 4), np.arange(-250.0, 101, 4))
    plane = np.stack([x.ravel(), y.ravel(), -slope * y.ravel()], axis=1)
    skin = replace(clean_scan(BODY.surface, FRONT), points=plane, normals=np.tile(FRONT, (len(plane), 1)))
    bones = {"suprasternal_notch": np.zeros(3), "xiphisternum": np.array([0.0, -150.0, 0.0])}
    given = {name: Landmark(place, "given", 5.0) for name, place in bones.items()}
    assert chest_rise(skin, given) == pytest.approx(slope * 2 / 3, abs=0.01)


def test_the_rise_is_unknown_without_both_bones() -> None:
    one = {name: mark for name, mark in marks().items() if name != "xiphisternum"}
    assert chest_rise(clean_scan(BODY.surface, FRONT), one) is None


def fit_at(offset: np.ndarray) -> Fit:
    landmarks = {name: place + offset for name, place in BODY.landmarks.items()}
    return Fit(Surface(np.eye(3), np.array([[0, 1, 2]])), landmarks, {}, 1.0, 1.0, 0.5)


def test_the_landmark_residual_is_the_distance_to_the_clicks() -> None:
    clicks = {name: Landmark(BODY.landmarks[name], "given", 5.0) for name in LANDMARK_NAMES}
    assert landmark_residual(fit_at(np.array([3.0, 4.0, 0.0])), clicks) == {"landmark_residual_mm": pytest.approx(5.0)}


def test_suggestions_do_not_vouch_for_themselves() -> None:
    suggested = {name: Landmark(BODY.landmarks[name], "suggested", 5.0) for name in LANDMARK_NAMES}
    assert landmark_residual(fit_at(np.zeros(3)), suggested) == {}


MAN, WOMAN = Patient(40, "male"), Patient(40, "female")


def strain_of(name: LandmarkName, off_mm: float, patient: Patient, sternum_mm: float = 150.0) -> float:
    clicks = {**marks(), name: Landmark(BODY.landmarks[name] + [off_mm, 0, 0], "given", 5.0)}
    return landmark_strain(fit_at(np.zeros(3)), clicks, patient, sternum_mm)["landmark_strain"]


def test_the_worst_click_strains_most_where_the_body_allows_least() -> None:
    assert strain_of("navel", 40, MAN) > 1.5 * strain_of("suprasternal_notch", 40, MAN)


def test_a_nipple_far_up_strains_a_mans_fit_and_hardly_a_womans() -> None:
    assert strain_of("nipple_left", 50, MAN) > 3.2
    assert strain_of("nipple_left", 50, WOMAN) < 2.0


def test_the_same_click_error_strains_a_baby_more_but_not_in_proportion() -> None:
    adult, baby = strain_of("navel", 20, MAN), strain_of("navel", 20, MAN, sternum_mm=50.0)
    assert adult < baby < 2 * adult


def test_nothing_strains_without_clicks() -> None:
    assert landmark_strain(fit_at(np.zeros(3)), {}, MAN, 150.0) == {}
