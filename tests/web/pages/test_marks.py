"""What was said about points, as pure values."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from lubdub.results import LANDMARK_NAMES, LandmarkName
from lubdub.web.pages.marks import Marks, asked_points

ASKED = LANDMARK_NAMES
PLACE = [1.0, 2.0, 3.0]

STUCK = {"suprasternal_notch": [0.0, 0.1, 0.2], "xiphisternum": [0.0, -0.1, 0.2]}

step = st.one_of(
    st.tuples(st.just("place"), st.sampled_from(LANDMARK_NAMES)),
    st.tuples(st.just("choose"), st.sampled_from(LANDMARK_NAMES)),
    st.tuples(st.sampled_from(["keep", "skip", "next"]), st.none()),
)


def taken(marks: Marks, action: str, name: LandmarkName | None) -> Marks:
    if action == "place" and name is not None:
        return marks.with_placed(name, PLACE)
    if action == "choose" and name is not None:
        return marks.choosing(name)
    return {"keep": marks.keeping, "skip": marks.skipping, "next": marks.onward}[action](ASKED)


stickers = st.sampled_from([{}, STUCK, {"xiphisternum": STUCK["xiphisternum"]}])


@given(st.lists(step, max_size=15), stickers)
def test_a_point_is_never_two_things_at_once(
    steps: list[tuple[str, LandmarkName | None]], stuck: dict[str, list[float]]
) -> None:
    marks = Marks().confirmed(ASKED, stuck)
    for action, name in steps:
        marks = taken(marks, action, name).confirmed(ASKED, stuck)
        assert set(marks.stuck) <= set(marks.placed)
        assert not set(marks.placed) & set(marks.skipped)
        assert not set(marks.placed) & set(marks.kept)
        assert not set(marks.kept) & set(marks.skipped)


@given(st.lists(step, max_size=15))
def test_marks_come_back_from_the_store_as_they_went_in(steps: list[tuple[str, LandmarkName | None]]) -> None:
    marks = Marks().confirmed(ASKED, STUCK)
    for action, name in steps:
        marks = taken(marks, action, name)
    assert Marks.from_bytes(marks.to_bytes()) == marks


@given(st.sampled_from(LANDMARK_NAMES), st.lists(step, max_size=6))
def test_undo_takes_back_a_placed_point(name: LandmarkName, before: list[tuple[str, LandmarkName | None]]) -> None:
    marks = Marks().confirmed(ASKED, STUCK)
    for action, other in before:
        marks = taken(marks, action, other)
    back = marks.with_placed(name, [9.0, 9.0, 9.0]).undone()
    assert back == marks


def test_bones_come_first_and_the_target_stays_until_confirmed() -> None:
    marks = Marks().confirmed(ASKED)
    assert marks.target == "suprasternal_notch"
    marks = marks.with_placed("suprasternal_notch", PLACE)
    assert marks.target == "suprasternal_notch"
    assert marks.onward(ASKED).target == "xiphisternum"


def test_when_everything_is_answered_no_point_is_asked_for() -> None:
    marks = Marks().confirmed(ASKED)
    for _ in ASKED:
        marks = marks.skipping(ASKED)
    assert marks.target is None


def test_nipples_are_not_asked_of_women_past_puberty() -> None:
    assert "nipple_left" not in asked_points("female", 30.0, 12.0)
    assert "nipple_left" not in asked_points("female", None, 12.0)
    assert "nipple_left" in asked_points("female", 8.0, 12.0)
    assert "nipple_left" in asked_points("male", 30.0, 12.0)
    assert asked_points("female", 30.0, 12.0)[:2] == ("suprasternal_notch", "xiphisternum")


def test_points_with_stickers_are_marked_and_the_first_without_is_asked_for() -> None:
    marks = Marks().confirmed(ASKED, STUCK)
    assert marks.placed == STUCK
    assert set(marks.stuck) == set(STUCK)
    assert marks.target == "navel"


def test_a_point_moved_off_its_sticker_is_the_persons() -> None:
    marks = Marks().confirmed(ASKED, STUCK).choosing("xiphisternum")
    assert "xiphisternum" in marks.stuck
    moved = marks.with_placed("xiphisternum", PLACE)
    assert moved.stuck == ("suprasternal_notch",)
    assert moved.confirmed(ASKED, STUCK).placed["xiphisternum"] == PLACE
    assert moved.undone().stuck == marks.stuck


def test_what_was_stored_before_there_were_stickers_can_be_read() -> None:
    said = json.loads(Marks().confirmed(ASKED).to_bytes())
    del said["stuck"]
    assert Marks.from_bytes(json.dumps(said).encode()) == Marks().confirmed(ASKED)
