"""Stickers on a scan: they mark the bones, check the size and prove the sides, and a person's hand outweighs them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from lubdub import stickers
from lubdub.geometry.stickers import STICKERS, SeenSticker
from lubdub.library.load import load_library
from lubdub.pipeline import Request, examine, locate
from lubdub.report.result_json import examination_json, result_json
from lubdub.results import LandmarkName, Library, Outcome, Patient, RawScan, ScanRefused
from lubdub.scans.reasons import MIRRORED_FILE
from lubdub.stickers import Prepared, prepare
from tests import bodies
from tests.painted import BONES, PaintedScan, painted, stuck_on

MAN = Patient(40, "male")
NOTCH = next(one for one in STICKERS if one.bone == "suprasternal_notch" and one.size == "large")
END = next(one for one in STICKERS if one.bone == "xiphisternum" and one.size == "large")


@cache
def library() -> Library:
    return load_library()


@cache
def scan() -> PaintedScan:
    return painted()


def run(of: PaintedScan, names: tuple[LandmarkName, ...] = ()) -> Outcome:
    clicked = {name: of.scan.landmarks[name] for name in names}
    return locate(bodies.write_textured_glb(of.scan.surface, of.colouring), Request(MAN, clicked), library())


def codes(reasons: object) -> list[str]:
    return [reason.code for reason in reasons]  # type: ignore[attr-defined]


def test_stickers_mark_both_bones_so_that_nobody_has_to() -> None:
    outcome = run(scan(), ("navel", "nipple_left", "nipple_right"))
    assert outcome.verdict == "show"
    document = result_json(outcome)
    assert {document["landmarks"][bone]["source"] for bone in BONES} == {"sticker"}
    for bone in BONES:
        assert np.linalg.norm(document["landmarks"][bone]["position"] - scan().scan.landmarks[bone]) < 2
    assert document["stickers"]["found"] == list(BONES)
    assert abs(document["stickers"]["scale"] - 1) < 0.02
    assert document["stickers"]["handedness"] == "proved"


def test_with_stickers_alone_the_body_is_laid_right_and_the_bones_count_as_marked() -> None:
    outcome = run(scan())
    assert outcome.verdict != "refuse"
    assert not {"bones_not_given", "notch_not_given", "lower_end_not_given", "landmarks_suggested"} & set(
        codes(outcome.reasons)
    )
    assert outcome.landmarks["navel"].source == "suggested"


def test_an_examination_has_the_stickers_points_before_anybody_marked_one() -> None:
    of = scan()
    data = bodies.write_textured_glb(of.scan.surface, of.colouring)
    document = examination_json(examine(data, Request(MAN), library()))
    suggested = document["suggested_landmarks"]
    assert {name for name, mark in suggested.items() if mark["source"] == "sticker"} == set(BONES)
    assert document["stickers"]["found"] == list(BONES)


@pytest.mark.parametrize("wound_again", [False, True])
def test_a_mirrored_scan_is_refused_because_its_stickers_read_backwards(wound_again: bool) -> None:
    of = scan().mirrored(wound_again)
    outcome = run(of, ("navel", "nipple_left", "nipple_right"))
    assert (outcome.verdict, codes(outcome.reasons)) == ("refuse", ["mirrored_by_stickers"])
    with pytest.raises(ScanRefused) as refusal:
        examine(bodies.write_textured_glb(of.scan.surface, of.colouring), Request(MAN), library())
    assert refusal.value.reason.code == "mirrored_by_stickers"


def test_a_later_refusal_still_tells_of_the_stickers() -> None:
    landmarks = scan().scan.landmarks
    crossed = {"nipple_left": landmarks["nipple_right"], "nipple_right": landmarks["nipple_left"]}
    data = bodies.write_textured_glb(scan().scan.surface, scan().colouring)
    outcome = locate(data, Request(MAN, crossed), library())
    assert (outcome.verdict, codes(outcome.reasons)) == ("refuse", ["sides_swapped"])
    assert result_json(outcome)["stickers"]["found"] == list(BONES)


def test_stickers_that_read_forwards_clear_a_file_that_says_it_is_mirrored() -> None:
    said = replace(scan().raw, warnings=(MIRRORED_FILE,))
    assert prepare(said, "mm", {}).scan.warnings == ()
    assert prepare(replace(said, colouring=None), "mm", {}).scan.warnings == (MIRRORED_FILE,)


def test_one_sticker_is_used_and_the_other_bone_still_asked_for() -> None:
    outcome = run(painted(stuck=stuck_on(1.0, ("suprasternal_notch",))), ("navel", "nipple_left", "nipple_right"))
    assert outcome.landmarks["suprasternal_notch"].source == "sticker"
    assert "lower_end_not_given" in codes(outcome.reasons)
    assert result_json(outcome)["stickers"]["found"] == ["suprasternal_notch"]


def nipples(of: PaintedScan) -> list[tuple[float, float]]:
    """(off, doubt) in mm of each suggested nipple, when nobody marked anything."""
    seen = examine(bodies.write_textured_glb(of.scan.surface, of.colouring), Request(MAN), library())
    in_file = seen.scan.body_from_file.inverse()
    return [
        (float(np.linalg.norm(in_file.apply(mark.position) - of.scan.landmarks[name])), mark.uncertainty_mm)
        for name, mark in seen.suggested.items()
        if name.startswith("nipple")
    ]


def test_areolas_that_show_bring_the_suggested_nipples_to_them() -> None:
    pictures = tuple(
        np.repeat(one.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8) for one in scan().colouring.pictures
    )
    grey = replace(scan(), colouring=replace(scan().colouring, pictures=pictures))
    for (off, doubt), (off_by_shape, doubt_by_shape) in zip(nipples(scan()), nipples(grey), strict=True):
        assert off < 4.0 < off_by_shape
        assert off < doubt < doubt_by_shape


def test_only_what_colours_can_still_find_is_read_from_them() -> None:
    of = scan()
    soft = {name: of.scan.landmarks[name] for name in ("navel", "nipple_left", "nipple_right")}
    assert prepare(of.raw, "mm", {}).tint is not None
    assert prepare(of.raw, "mm", soft).tint is None
    assert prepare(replace(of.raw, colouring=None), "mm", {}).tint is None


def test_colour_without_stickers_changes_nothing_that_was_marked() -> None:
    bare = painted(stuck=())
    coloured = run(bare, tuple(bare.scan.landmarks))
    without = replace(bare.colouring, picture=np.full(len(bare.scan.surface.triangles), -1, np.int8))
    plain = run(replace(bare, colouring=without), tuple(bare.scan.landmarks))
    assert coloured.stickers is None
    assert coloured.verdict == plain.verdict
    for name, area in plain.areas.items():
        assert np.array_equal(area.position, coloured.areas[name].position)


def seen(monkeypatch: pytest.MonkeyPatch, *read: SeenSticker) -> RawScan:
    """A scan on which exactly these are read."""
    monkeypatch.setattr(stickers, "find_stickers", lambda *_: read)
    return scan().raw


def read_as(sticker: object, place: np.ndarray, scale: float = 1.0, is_mirrored: bool = False) -> SeenSticker:
    return SeenSticker(sticker, place, np.array([0.0, 0.0, 1.0]), scale, 0, is_mirrored)  # type: ignore[arg-type]


def both(scale: float = 1.0, is_mirrored: tuple[bool, bool] = (False, False)) -> tuple[SeenSticker, ...]:
    places = scan().scan.landmarks
    pairs = zip((NOTCH, END), is_mirrored, strict=True)
    return tuple(read_as(one, places[one.bone], scale, mirrored) for one, mirrored in pairs)


@pytest.mark.parametrize(("scale", "warned"), [(0.96, False), (1.04, False), (0.92, True), (1.1, True), (1.19, True)])
def test_a_size_a_little_off_is_told_and_more_than_that_refused(
    monkeypatch: pytest.MonkeyPatch, scale: float, warned: bool
) -> None:
    ready = prepare(seen(monkeypatch, *both(scale)), "mm", {})
    assert codes(ready.warnings) == ["sticker_size_doubtful"] * warned
    assert ready.by_sticker == set(BONES)


@pytest.mark.parametrize("scale", [0.1, 0.7, 1.3, 10.0])
def test_a_size_far_off_is_refused_when_the_unit_was_given(monkeypatch: pytest.MonkeyPatch, scale: float) -> None:
    with pytest.raises(ScanRefused) as refusal:
        prepare(seen(monkeypatch, *both(scale)), "mm", {})
    assert refusal.value.reason.code == "sticker_size_untrue"


def test_stickers_name_the_unit_when_nobody_did(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = seen(monkeypatch, *both(0.1))
    ready = prepare(raw, None, {})
    assert (ready.scan.unit.name, ready.scan.unit.source) == ("cm", "sticker")
    assert ready.proof is not None
    assert abs(ready.proof.scale - 1) < 1e-3
    for bone in BONES:
        assert np.allclose(ready.marked[bone], scan().scan.landmarks[bone])


def clicked_beside(monkeypatch: pytest.MonkeyPatch, offset: float) -> Prepared:
    places = scan().scan.landmarks
    click = {"xiphisternum": places["xiphisternum"] + [0.0, offset, 0.0]}
    return prepare(seen(monkeypatch, *both()), "mm", click)  # type: ignore[arg-type]


def test_a_point_left_on_its_sticker_is_the_stickers(monkeypatch: pytest.MonkeyPatch) -> None:
    ready = clicked_beside(monkeypatch, 4.0)
    assert "xiphisternum" in ready.by_sticker
    assert np.allclose(ready.marked["xiphisternum"], scan().scan.landmarks["xiphisternum"])
    assert ready.warnings == ()


@pytest.mark.parametrize(("offset", "told"), [(12.0, []), (20.0, []), (40.0, ["away_from_sticker"])])
def test_a_point_that_was_moved_wins_and_a_far_one_is_told(
    monkeypatch: pytest.MonkeyPatch, offset: float, told: list[str]
) -> None:
    ready = clicked_beside(monkeypatch, offset)
    assert ready.by_sticker == {"suprasternal_notch"}
    assert np.allclose(ready.marked["xiphisternum"], scan().scan.landmarks["xiphisternum"] + [0.0, offset, 0.0])
    assert codes(ready.warnings) == told


def test_two_stickers_for_one_bone_are_both_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    more = read_as(NOTCH, scan().scan.landmarks["suprasternal_notch"] + [60.0, 0.0, 0.0])
    ready = prepare(seen(monkeypatch, *both(), more), "mm", {})
    assert ready.by_sticker == {"xiphisternum"}
    assert codes(ready.warnings) == ["sticker_seen_twice"]


def test_stickers_that_contradict_each_other_stop_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ScanRefused) as refusal:
        prepare(seen(monkeypatch, *both(is_mirrored=(True, False))), "mm", {})
    assert refusal.value.reason.code == "stickers_contradictory"


def test_a_scan_without_colour_is_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("looked")

    monkeypatch.setattr(stickers, "find_stickers", never)
    plain = replace(scan().raw, colouring=None)
    assert prepare(plain, "mm", {}).proof is None


def test_stickers_put_on_the_wrong_bones_are_refused() -> None:
    top, end = stuck_on(1.0)
    swapped = (replace(top, sticker=END), replace(end, sticker=NOTCH))
    outcome = run(painted(stuck=swapped))
    assert (outcome.verdict, codes(outcome.reasons)) == ("refuse", ["stickers_swapped"])
