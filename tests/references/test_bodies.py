"""The shipped bodies obey the anatomy table, are whole, and are the patient's own left and right."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lubdub.geometry.surface import carry
from lubdub.library.load import SHIPPED, load_library
from lubdub.results import Reference
from references.make.anatomy import area_offsets, fourth_space_share, sternum_mm

REFERENCES = load_library().references
each_reference = pytest.mark.parametrize("reference", REFERENCES, ids=lambda reference: reference.id)

TABLE = {"aortic": (0.40, -0.17), "pulmonary": (0.40, 0.17), "tricuspid": (0.81, 0.22)}
"""Below the notch and to the patient's left, in sternum lengths: the anatomy table, written out again."""


def in_sternums(reference: Reference, name: str) -> tuple[float, float]:
    """(below the notch, left of the midline) in sternum lengths, in frontal projection."""
    notch, xiphoid = reference.landmarks["suprasternal_notch"], reference.landmarks["xiphisternum"]
    length = notch[1] - xiphoid[1]
    place = reference.areas[name] - notch  # type: ignore[index]
    return -place[1] / length, place[0] / length


@each_reference
@pytest.mark.parametrize("area", sorted(TABLE))
def test_areas_lie_where_the_table_puts_them_on_this_bodys_own_bones(reference: Reference, area: str) -> None:
    assert in_sternums(reference, area) == pytest.approx(TABLE[area], abs=0.002)


@each_reference
def test_the_mitral_area_moves_from_the_fourth_to_the_fifth_space_with_age(reference: Reference) -> None:
    years = reference.card["age_years"]
    share = 1.0 if years < 4 else {4: 0.92, 5: 0.51, 6: 0.14}.get(years, 0.0)
    expected = share * np.array([0.90, 0.58]) + (1 - share) * np.array([1.06, 0.54])
    assert in_sternums(reference, "mitral") == pytest.approx(tuple(expected), abs=0.002)


@each_reference
def test_the_patients_left_is_at_positive_x(reference: Reference) -> None:
    assert reference.landmarks["nipple_left"][0] > 0 > reference.landmarks["nipple_right"][0]
    assert reference.areas["mitral"][0] > reference.areas["pulmonary"][0] > 0 > reference.areas["aortic"][0]


@each_reference
def test_the_body_frame_starts_at_the_notch_with_the_front_at_positive_z(reference: Reference) -> None:
    np.testing.assert_allclose(reference.landmarks["suprasternal_notch"], 0.0, atol=0.01)
    assert reference.surface.normals[:, 2][reference.surface.vertices[:, 2] > 0].mean() > 0.5


@each_reference
def test_the_sternum_has_the_length_of_the_age(reference: Reference) -> None:
    card = reference.card
    length = reference.landmarks["suprasternal_notch"][1] - reference.landmarks["xiphisternum"][1]
    assert length == pytest.approx(sternum_mm(card["age_years"], card["sex"], card["stature_mm"]), abs=0.1)


@each_reference
def test_marks_stored_as_places_and_as_barycentrics_agree(reference: Reference) -> None:
    with np.load(SHIPPED / "bodies" / reference.id / "body.npz") as arrays:
        for kind in ("landmark", "area"):
            carried = carry(arrays[f"{kind}_weights"], arrays[f"{kind}_corners"], reference.surface.vertices)
            np.testing.assert_allclose(carried, arrays[f"{kind}_positions"], atol=0.05)


@each_reference
def test_nipples_and_navel_lie_in_the_human_range(reference: Reference) -> None:
    notch, xiphoid = reference.landmarks["suprasternal_notch"], reference.landmarks["xiphisternum"]
    length = notch[1] - xiphoid[1]
    assert 0.7 < (notch - reference.landmarks["nipple_left"])[1] / length < 1.3
    assert 1.9 < (notch - reference.landmarks["navel"])[1] / length < 2.8


@each_reference
def test_the_apex_lies_medial_to_the_nipple_line(reference: Reference) -> None:
    assert reference.areas["mitral"][0] < reference.landmarks["nipple_left"][0]


@each_reference
def test_no_triangle_is_a_spike(reference: Reference) -> None:
    surface = reference.surface
    sides = np.linalg.norm(
        surface.vertices[surface.triangles] - surface.vertices[surface.triangles[:, [1, 2, 0]]], axis=2
    )
    assert sides.max() < 0.5 * reference.card["sternum_mm"]


@each_reference
def test_every_card_says_who_placed_the_marks_and_under_which_licence(reference: Reference) -> None:
    assert reference.card["placed_by"] == "anatomy table, no clinician"
    assert reference.card["licence"] == "CC0-1.0"
    assert {"method", "source", "recipe", "description", "posture"} <= set(reference.card)


def test_the_bodies_span_newborn_to_old_age_in_both_sexes() -> None:
    for sex in ("female", "male"):
        ages = [one.card["age_years"] for one in REFERENCES if one.card["sex"] == sex]
        assert min(ages) == 0
        assert max(ages) >= 70


@pytest.mark.parametrize(("years", "share"), [(0, 1), (3.9, 1), (4, 0.92), (5, 0.51), (6, 0.14), (7, 0), (40, 0)])
def test_the_fourth_space_share_follows_the_study(years: float, share: float) -> None:
    assert fourth_space_share(years) == pytest.approx(share)


def test_area_offsets_are_left_then_headwards() -> None:
    aortic, pulmonary, tricuspid, mitral = area_offsets(30.0)
    assert tuple(aortic) == (-0.17, -0.40)
    assert tuple(pulmonary) == (0.17, -0.40)
    assert tuple(tricuspid) == (0.22, -0.81)
    assert tuple(mitral) == (0.54, -1.06)


@pytest.mark.parametrize("name", ["overhead-bed", "phone-child", "scanner-woman"])
def test_a_demo_scan_comes_with_clicks_near_the_truth(name: str) -> None:
    folder = Path(SHIPPED) / "demo" / name
    clicks, truth = (json.loads((folder / file).read_text()) for file in ("landmarks.json", "truth.json"))
    for landmark, place in truth["landmarks"].items():
        error = np.linalg.norm(np.subtract(place, clicks[landmark])) * truth["mm_per_unit"]
        assert error < 15
    assert max(file.stat().st_size for file in folder.iterdir()) <= 2_500_000


@each_reference
def test_the_notch_is_as_far_above_the_navel_in_girls_as_in_boys(reference: Reference) -> None:
    stature = reference.card["recipe"]["stature_mm"]
    assert 0.185 < -reference.landmarks["navel"][1] / stature < 0.215
