"""Each damage does what it says and nothing else; the count of far-off places misses none."""

from __future__ import annotations

import numpy as np
import pytest

from lubdub.library.load import load_library
from lubdub.results import AREA_NAMES, LANDMARK_NAMES
from lubdub.scans.read import read_scan
from lubdub.stages import ADULT_STERNUM_MM
from tests.benchmark import damage
from tests.benchmark.damage import Draft, Staging
from tests.benchmark.damaged import DAMAGES, GOOD, Damage, far_off, limits_mm, measured, report
from tests.benchmark.experiment import Row

NUMBER = 3


def staging(number: int = NUMBER) -> Staging:
    return Staging.of(1, number, 0)


@pytest.fixture(scope="module")
def ordinary() -> Draft:
    return damage.good(staging())


def changed(draft: Draft, ordinary: Draft) -> set[str]:
    return {name for name in LANDMARK_NAMES if np.linalg.norm(draft.clicks[name] - ordinary.clicks[name]) > 1e-6}


def handedness(draft: Draft) -> float:
    """Above 0 for a body whose navel, left nipple and front lie as they should."""
    notch, navel, left, right = draft.landmarks[[0, 2, 3, 4]]
    inside = np.array([0.0, 0.0, -1000.0])
    return float(np.linalg.det(np.stack([left - right, notch - navel, notch - inside])))


def test_a_mirrored_scan_is_the_mirror_image_of_the_good_one(ordinary: Draft) -> None:
    mirrored = damage.mirrored_by_body(staging())
    np.testing.assert_allclose(mirrored.surface.vertices * [-1, 1, 1], ordinary.surface.vertices)
    np.testing.assert_allclose(mirrored.areas * [-1, 1, 1], ordinary.areas)
    assert handedness(ordinary) > 0 > handedness(mirrored)


def test_clicks_by_the_body_follow_the_mirror_and_clicks_by_the_picture_exchange_the_sides(ordinary: Draft) -> None:
    by_body, by_picture = damage.mirrored_by_body(staging()), damage.mirrored_by_picture(staging())
    for name, place in ordinary.clicks.items():
        np.testing.assert_allclose(by_body.clicks[name] * [-1, 1, 1], place)
    np.testing.assert_array_equal(by_picture.clicks["nipple_left"], by_body.clicks["nipple_right"])
    np.testing.assert_array_equal(by_picture.clicks["navel"], by_body.clicks["navel"])


def test_without_a_bone_marked_only_what_the_eye_sees_is_clicked() -> None:
    marked = damage.half_missing(0, 1.0)(staging()).clicks
    unfelt = damage.boneless(damage.half_missing(0, 1.0))(staging()).clicks
    assert unfelt
    assert set(unfelt) == set(marked) - {"suprasternal_notch", "xiphisternum"}


@pytest.mark.parametrize(("axis", "side"), [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)])
def test_half_a_scan_keeps_one_side_and_only_the_clicks_on_it(axis: int, side: float, ordinary: Draft) -> None:
    half = damage.half_missing(axis, side)(staging())
    middle = ordinary.landmarks[:2].mean(axis=0)[axis]
    assert (side * (half.surface.vertices[:, axis] - middle) > -20).all()
    assert 0.2 < len(half.surface.vertices) / len(ordinary.surface.vertices) < 0.8
    assert set(half.clicks) < set(LANDMARK_NAMES)
    for place in half.clicks.values():
        assert side * (place[axis] - middle) > -40


def test_a_funnel_chest_is_deepest_at_the_breastbones_lower_end_and_its_marks_lie_in_it(ordinary: Draft) -> None:
    sunken = damage.sunken(25.0)(staging())
    sunk = (ordinary.surface.vertices - sunken.surface.vertices)[:, 2]
    notch, joint = ordinary.landmarks[:2]
    depth = 25.0 * np.linalg.norm(joint - notch) / ADULT_STERNUM_MM
    deepest = ordinary.surface.vertices[np.argmax(sunk)]
    assert 0.9 * depth < sunk.max() <= depth
    assert np.linalg.norm((deepest - joint)[:2]) < 0.4 * np.linalg.norm(joint - notch)
    assert np.linalg.norm(sunken.landmarks[1] - joint) > 0.7 * depth
    assert sunken.clicks["xiphisternum"][2] < ordinary.clicks["xiphisternum"][2] - 0.7 * depth


@pytest.mark.parametrize("name", LANDMARK_NAMES)
def test_a_wild_click_moves_one_landmark_far_and_leaves_the_others(name, ordinary: Draft) -> None:
    wild = damage.one_wild(name)(staging())
    assert changed(wild, ordinary) == {name}
    assert np.linalg.norm(wild.clicks[name] - ordinary.clicks[name]) > 35


def test_the_hollow_lies_above_the_bone_on_the_skin(ordinary: Draft) -> None:
    hollow = damage.hollow_clicked(staging())
    rise = hollow.clicks["suprasternal_notch"] - ordinary.clicks["suprasternal_notch"]
    assert changed(hollow, ordinary) == {"suprasternal_notch"}
    assert 8 < rise[1] < 42


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (damage.nipples_swapped, {"nipple_left", "nipple_right"}),
        (damage.notch_and_navel_swapped, {"suprasternal_notch", "navel"}),
    ],
)
def test_swapped_clicks_are_exchanged_and_the_scan_is_untouched(make, names, ordinary: Draft) -> None:
    swapped = make(staging())
    assert changed(swapped, ordinary) == names
    np.testing.assert_array_equal(swapped.surface.vertices, ordinary.surface.vertices)


@pytest.mark.parametrize(
    ("make", "unit", "millimetres"),
    [
        (damage.centimetres_called_metres, "m", 10.0),
        (damage.inches_not_said, None, 25.4),
        (damage.inches_called_centimetres, "cm", 25.4),
    ],
)
def test_a_wrong_unit_changes_the_numbers_in_the_file_not_the_person(make, unit, millimetres: float) -> None:
    stage = staging()
    case = make(stage).case(stage, "unit")
    assert case.unit == unit
    assert case.mm_per_unit == pytest.approx(millimetres)
    height = np.linalg.norm(case.landmarks["suprasternal_notch"] - case.landmarks["navel"]) * case.mm_per_unit
    assert height == pytest.approx(np.linalg.norm(stage.subject.landmarks[2]), rel=0.05)


def test_a_scan_ten_percent_too_large_is_measured_in_true_millimetres() -> None:
    plain, large = (make(stage := staging()).case(stage, "") for make in (damage.good, damage.scaled(1.1)))
    assert large.mm_per_unit == pytest.approx(plain.mm_per_unit / 1.1)
    np.testing.assert_allclose(large.areas["mitral"], 1.1 * plain.areas["mitral"])
    ratio = read_scan(large.data).surface.vertices.max() / read_scan(plain.data).surface.vertices.max()
    assert ratio == pytest.approx(1.1, rel=1e-4)


def test_motion_lays_a_second_pose_over_the_first_a_little_beside_it(ordinary: Draft) -> None:
    blurred = damage.motion_blur(staging()).surface.vertices
    first, second = np.split(blurred, 2)
    np.testing.assert_array_equal(first, ordinary.surface.vertices)
    assert 2.5 <= np.linalg.norm(second - first, axis=1).mean() <= 20


@pytest.mark.parametrize("garment", ["T-shirt", "band", "cloth"])
def test_clothes_lie_over_the_skin_and_leave_the_truth_below(garment: str, ordinary: Draft) -> None:
    stage = staging(5)
    worn = damage.dressed(garment)(stage)
    bare = damage.good(staging(5))
    np.testing.assert_allclose(worn.areas, bare.areas)
    chest = [np.abs(draft.surface.vertices[:, :2] - bare.landmarks[1, :2]).max(axis=1) < 60 for draft in (worn, bare)]
    lifted = worn.surface.vertices[chest[0], 2].mean() - bare.surface.vertices[chest[1], 2].mean()
    assert -1.0 < lifted < 30.0


def test_two_people_are_wider_than_one_and_clicks_can_be_on_both(ordinary: Draft) -> None:
    both, mixed = damage.two_people(staging()), damage.clicks_on_two_people(staging())
    assert np.ptp(both.surface.vertices[:, 0]) > 1.2 * np.ptp(ordinary.surface.vertices[:, 0])
    reach = np.linalg.norm(mixed.clicks["navel"] - mixed.landmarks[2])
    assert reach > 100
    assert np.linalg.norm(mixed.clicks["xiphisternum"] - mixed.landmarks[1]) < 40


def test_on_a_back_the_heart_lies_on_the_side_away_from_the_camera() -> None:
    draft = damage.back_side(by_body=False)(staging())
    assert min(place[2] for place in draft.clicks.values()) > draft.areas[:, 2].max() + 50
    assert draft.clicks["nipple_left"][0] > draft.clicks["nipple_right"][0]


def test_the_same_damage_of_the_same_person_is_the_same_file() -> None:
    one, two = (damage.motion_blur(stage := staging(4)).case(stage, "blur") for _ in range(2))
    assert one.data == two.data


def test_what_counts_as_far_off_grows_with_the_breastbone_and_is_widest_at_the_apex() -> None:
    adult, child = limits_mm(30.0, 150.0), limits_mm(30.0, 75.0)
    assert adult["mitral"] > adult["tricuspid"] > adult["aortic"] > 20
    for name in AREA_NAMES:
        assert adult[name] - 20 == pytest.approx(2 * (child[name] - 20), rel=1e-3)


def row(name: str, verdict: str, beyond: float | None) -> Row:
    errors = {} if beyond is None else {f"{area}_mm": 40.0 for area in AREA_NAMES}
    fields = {"damage": name, "case": name, "camera": "", "group": "", "verdict": verdict, "reasons": "why"}
    return {**fields, **errors, "beyond_limit_mm": beyond}


def test_only_what_is_shown_without_care_and_beyond_its_limit_counts_against_us() -> None:
    rows = [row("legs", "show", 3.0), row("legs", "show", -3.0), row("head", "show_with_care", 9.0)]
    rows += [row("head", "refuse", None), row(GOOD.name, "show", -1.0), row(GOOD.name, "show_with_care", -1.0)]
    numbers = report(rows).numbers
    assert numbers["silent_far_off"] == 1
    assert numbers["good_shown_share"] == 0.5
    assert far_off(rows) == 2


def test_what_no_scan_can_show_is_counted_apart() -> None:
    invisible = next(one.name for one in DAMAGES if not one.visible)
    found = report([row(invisible, "show", 100.0), row(GOOD.name, "show", -1.0)])
    assert found.numbers["silent_far_off"] == 0
    assert next(iter(found.tables[1].rows))[0] == invisible


def test_a_file_with_nothing_in_it_counts_as_refused() -> None:
    def nowhere(one: Staging) -> Draft:
        draft = damage.good(one)
        return draft.kept(np.zeros(len(draft.surface.vertices), bool))

    nothing = Damage("nothing", nowhere)
    found = measured(staging(), nothing, load_library())
    assert (found["verdict"], found["reasons"], found["beyond_limit_mm"]) == ("refuse", "unreadable", None)
