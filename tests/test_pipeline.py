"""The whole journey, on made-up torsos of another origin than the references."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lubdub.geometry.surface import Surface
from lubdub.library.load import load_library
from lubdub.pipeline import Request, examine, locate
from lubdub.report.result_json import result_json
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Library, Outcome, Patient, ScanUnreadable
from tests import bodies
from tests.bodies import BodyScan

MAN, GIRL = Patient(40, "male"), Patient(6, "female")
THREE = ("navel", "nipple_left", "nipple_right")


@cache
def library() -> Library:
    return load_library()


@cache
def bed_scan(size: float = 1.0) -> BodyScan:
    """One noisy side of a torso on a bed."""
    return bodies.noise(bodies.hide_side(bodies.add_bed(bodies.torso_scan(size=size))), 1.5)


def run(scan: BodyScan, patient: Patient = MAN, names: tuple = LANDMARK_NAMES, **options: object) -> Outcome:
    landmarks = {name: scan.landmarks[name] for name in names}
    data = options.pop("data", None) or bodies.write_ply(scan.surface)
    return locate(data, Request(patient, landmarks, **options), library())


def errors_mm(outcome: Outcome, scan: BodyScan) -> dict[str, float]:
    found = result_json(outcome)["areas"]
    scale = scan.file_from_body.scale
    return {
        name: float(np.linalg.norm(np.array(found[name]["position"]) - scan.areas[name])) / scale for name in AREA_NAMES
    }


def codes(outcome: Outcome) -> list[str]:
    return [reason.code for reason in outcome.reasons]


@pytest.mark.parametrize("method", ["lubdub", "rule"])
def test_with_five_landmarks_the_areas_are_shown_and_right(method: str) -> None:
    outcome = run(bed_scan(), method=method)
    assert outcome.verdict == "show"
    assert max(errors_mm(outcome, bed_scan()).values()) < 8


def test_the_papers_method_says_what_it_did() -> None:
    outcome = run(bed_scan(), method="paper", names=THREE)
    document = result_json(outcome)
    assert outcome.verdict == "show_with_care"
    assert len(document["references"]) == len(library().references)
    assert document["selected"] == document["references"][0]["id"]
    assert document["steps"]
    assert max(errors_mm(outcome, bed_scan()).values()) < 30


@settings(max_examples=5, deadline=None)
@given(
    st.tuples(*[st.floats(-180, 180)] * 3),
    st.tuples(*[st.floats(-900, 900)] * 3),
    st.sampled_from(["m", "cm", "mm"]),
)
def test_any_lie_and_any_unit_give_the_same_places_on_the_body(degrees: tuple, shift: tuple, unit: str) -> None:
    moved = bodies.rescale(bodies.turn(bed_scan(), degrees, shift), unit)
    outcome = run(moved)
    assert outcome.verdict == "show"
    assert outcome.scan is not None
    assert outcome.scan.unit.name == unit
    assert max(errors_mm(outcome, moved).values()) < 8


def test_the_areas_lie_on_the_files_own_surface() -> None:
    scan = bodies.rescale(bed_scan(), "m")
    document = result_json(run(scan, data=bodies.write_stl(scan.surface)))
    for area in document["areas"].values():
        distance = np.linalg.norm(scan.surface.vertices - np.array(area["position"]), axis=1).min()
        assert distance * 1000 < 6  # the mesh's own spacing


def test_a_child_gets_the_childs_apex() -> None:
    child = bed_scan(0.6)
    young, old = run(child, Patient(3, "female")), run(child, Patient(8, "female"))
    assert young.areas["mitral"].position[1] > old.areas["mitral"].position[1] + 5


def test_the_papers_three_landmarks_are_shown_only_with_care_and_wider() -> None:
    three, five = run(bed_scan(), names=THREE), run(bed_scan())
    assert three.verdict == "show_with_care"
    assert "bones_not_given" in codes(three)
    assert all(three.areas[name].radius_mm > five.areas[name].radius_mm for name in AREA_NAMES)
    assert three.landmarks["xiphisternum"].source == "suggested"


def test_without_any_landmark_all_are_suggested_and_that_is_said() -> None:
    outcome = run(bodies.turn(bed_scan(), (20, 70, 130)), names=())
    assert outcome.verdict == "show_with_care"
    assert "landmarks_suggested" in codes(outcome)
    assert {mark.source for mark in outcome.landmarks.values()} == {"suggested"}


@pytest.mark.parametrize(
    ("scan", "names", "reason"),
    [
        (bodies.mirror(bed_scan()), LANDMARK_NAMES, "sides_swapped"),
        (bodies.only_belly(bed_scan()), (), None),
        (bodies.only_belly(bed_scan()), ("navel",), None),
    ],
    ids=["mirrored", "belly only", "belly with its button marked"],
)
def test_hopeless_scans_are_refused_with_a_reason(scan: BodyScan, names: tuple, reason: str | None) -> None:
    outcome = run(scan, names=names)
    assert outcome.verdict == "refuse"
    assert outcome.areas == {}
    assert outcome.reasons[0].advice
    assert reason in (None, outcome.reasons[0].code)


@pytest.mark.parametrize(
    ("exchanged", "also"),
    [
        (("suprasternal_notch", "navel"), ()),
        (("suprasternal_notch", "navel"), ("xiphisternum",)),
        (("suprasternal_notch", "navel"), ("nipple_right",)),
        (("suprasternal_notch", "xiphisternum"), ()),
        (("suprasternal_notch", "xiphisternum"), ("nipple_left",)),
        (("suprasternal_notch", "navel"), ("xiphisternum", "nipple_left", "nipple_right")),
    ],
    ids=str,
)
@pytest.mark.parametrize("method", ["lubdub", "rule"])
def test_marks_with_head_and_feet_exchanged_are_never_shown(exchanged: tuple, also: tuple, method: str) -> None:
    scan, (top, low) = bed_scan(), exchanged
    marked = {**scan.landmarks, top: scan.landmarks[low], low: scan.landmarks[top]}
    outcome = run(replace(scan, landmarks=marked), names=(*exchanged, *also), method=method)
    assert outcome.verdict == "refuse"
    assert codes(outcome)[0] in ("points_out_of_order", "sides_swapped")


def test_marks_of_the_midline_in_their_order_are_shown() -> None:
    assert run(bed_scan(), names=("suprasternal_notch", "xiphisternum", "navel")).verdict == "show"


@pytest.mark.parametrize("method", ["lubdub", "rule"])
def test_a_single_nipple_on_the_other_side_is_refused(method: str) -> None:
    scan = bed_scan()
    crossed = replace(scan, landmarks={**scan.landmarks, "nipple_left": scan.landmarks["nipple_right"]})
    outcome = run(crossed, names=("suprasternal_notch", "xiphisternum", "nipple_left"), method=method)
    assert (outcome.verdict, codes(outcome)[0]) == ("refuse", "sides_swapped")


def test_a_file_that_says_it_mirrors_the_body_is_shown_with_care() -> None:
    scan = bodies.rescale(bed_scan(), "m")
    # The points are where they were: only the file says that something turned them round on the way.
    flipped = replace(scan.surface, vertices=scan.surface.vertices * [-1, 1, 1])
    outcome = run(scan, data=bodies.write_glb(flipped, np.diag([-1.0, 1, 1, 1])))
    assert (outcome.verdict, codes(outcome)) == ("show_with_care", ["mirrored_file"])


@pytest.mark.parametrize("method", ["lubdub", "rule", "paper"])
def test_progress_never_runs_backwards(method: str) -> None:
    heard: list[float] = []
    request = Request(MAN, bed_scan().landmarks, method=method)
    locate(bodies.write_ply(bed_scan().surface), request, library(), lambda stage, fraction: heard.append(fraction))
    assert heard == sorted(heard)


def test_the_shown_body_lies_on_the_marked_points_even_where_skin_and_marks_disagree() -> None:
    scan = bed_scan()
    up = {name: scan.file_from_body.turn(np.array([0.0, 15.0, 0.0])) for name in ("nipple_left", "nipple_right")}
    slid = replace(scan, landmarks={name: place + up.get(name, 0.0) for name, place in scan.landmarks.items()})
    outcome = run(slid)
    assert outcome.fit is not None
    for name, mark in outcome.landmarks.items():
        assert np.linalg.norm((outcome.fit.landmarks[name] - mark.position)[:2]) < 6


def test_an_adults_scan_said_to_be_a_babys_is_refused() -> None:
    assert run(bed_scan(), Patient(0.5, "male")).verdict == "refuse"


def test_without_an_age_the_result_is_shown_with_care() -> None:
    assert codes(run(bed_scan(), Patient(None, "male"))) == ["age_missing"]


def test_landmarks_of_another_scan_are_refused() -> None:
    outcome = locate(
        bodies.write_ply(bed_scan().surface),
        Request(MAN, {name: place + 4000 for name, place in bed_scan().landmarks.items()}),
        library(),
    )
    assert outcome.verdict == "refuse"


@pytest.mark.parametrize("data", [b"", b"hello", b"ply\n", b"\xff\xd8\xff\xe0 a photo"], ids=repr)
def test_what_is_no_scan_is_said_to_be_unreadable_in_one_sentence(data: bytes) -> None:
    with pytest.raises(ScanUnreadable) as error:
        locate(data, Request(), library())
    assert "\n" not in str(error.value)


def test_the_same_input_gives_the_same_bytes() -> None:
    first, second = (result_json(run(bed_scan())) for _ in range(2))
    first.pop("timings_s"), second.pop("timings_s")
    assert first == second


def test_progress_only_ever_grows() -> None:
    heard: list[float] = []
    data = bodies.write_ply(bed_scan().surface)
    locate(data, Request(MAN, dict(bed_scan().landmarks)), library(), lambda _, done: heard.append(done))
    assert heard == sorted(heard)
    assert 0 <= heard[0] < heard[-1] <= 1


def test_an_examination_knows_size_unit_and_suggestions() -> None:
    scan = bodies.rescale(bodies.turn(bed_scan(0.6), (0, 90, 10)), "cm")
    seen = examine(bodies.write_ply(scan.surface), Request(GIRL), library())
    assert seen.scan.unit.name == "cm"
    assert seen.size["chest_width_mm"] == pytest.approx(0.6 * 330, rel=0.15)
    assert set(seen.suggested) == set(LANDMARK_NAMES)
    assert seen.coverage > 0.8


def test_a_belly_is_shown_to_be_marked_and_refused_whatever_is_marked_on_it() -> None:
    belly = bodies.only_belly(bed_scan())
    seen = examine(bodies.write_ply(belly.surface), Request(MAN), library())
    assert seen.warnings[0].code == "lie_unclear"
    assert run(belly, names=("navel", "xiphisternum")).verdict == "refuse"


def smooth_body() -> BodyScan:
    """A trunk without any feature that says where the head is, as a phone's depth sensor leaves of a small baby."""
    body = bodies.hide_side(bodies.torso_scan())
    x, y = body.surface.vertices.T[:2]
    half, middle = np.ptp(y) / 2, (y.max() + y.min()) / 2
    along = (y - middle) / half
    bow = 60 * np.sqrt(np.clip(1 - 0.8 * along**2 - 0.6 * (x / np.ptp(x) * 2) ** 2, 0, None))
    smooth = np.column_stack([0.5 * x, 0.5 * y, bow])
    put = {
        name: smooth[np.argmin(np.linalg.norm((body.surface.vertices - place)[:, :2], axis=1))]
        for name, place in body.landmarks.items()
    }
    return replace(body, surface=Surface(smooth, body.surface.triangles), landmarks=put)


def test_a_body_whose_lie_is_unclear_is_shown_unsuggested_and_can_be_marked() -> None:
    scan = bodies.turn(smooth_body(), (15, 30, 110))
    patient = Patient(1.0, "male")
    seen = examine(bodies.write_ply(scan.surface), Request(patient), library())
    assert [warning.code for warning in seen.warnings][:1] == ["lie_unclear"]
    assert not seen.suggested
    assert seen.coverage is None
    assert 90 < seen.size["width_mm"] < 300
    unmarked = run(scan, patient, names=())
    assert unmarked.verdict == "refuse"
    assert codes(unmarked)[0] in ("orientation_unknown", "fit_failed")
    marked = run(scan, patient)
    assert marked.landmarks, codes(marked)  # the points alone said how it lies
