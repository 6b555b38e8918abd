"""What two people's marks make of a reference body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lubdub.geometry.anchors import anchored
from lubdub.library.load import LibraryDamaged, load_body, load_library, state_of
from lubdub.library.marks import AreaMarks, Step, drop_marks, read_marks, write_marks
from lubdub.results import AREA_NAMES, AreaName, Reference

GIRL = "girl-06"


@pytest.fixture(scope="module")
def girl() -> Reference:
    found = load_body(None, GIRL)
    assert found is not None
    return found


def marks_by(
    girl: Reference, who: str, moved: Mapping[AreaName, np.ndarray], at: str = "2026-01-02T03:04:05+00:00"
) -> AreaMarks:
    """Everybody puts the areas where they are in the table, but for those they move."""
    places = [girl.areas[name] + moved.get(name, np.zeros(3)) for name in AREA_NAMES]
    on_skin = anchored(girl.surface, np.array(places)).on(girl.surface.vertices)
    steps = tuple(Step(name, place) for name, place in zip(AREA_NAMES, on_skin, strict=True))
    return AreaMarks(girl.id, girl.card["sha256"], who, f"Dr {who}", "t" * 16, steps, 4, at)


def girl_in(folder: Path | None) -> Reference:
    return next(one for one in load_library(folder).references if one.id == GIRL)


SIDEWAYS = {"mitral": np.array([12.0, 0.0, 0.0])}


def test_two_who_marked_a_body_give_it_the_middle_of_their_places_and_their_distance(
    girl: Reference, tmp_path: Path
) -> None:
    first, second = marks_by(girl, "mori", {}), marks_by(girl, "silva", SIDEWAYS)
    for one in (first, second):
        write_marks(tmp_path, one)
    now = girl_in(tmp_path)
    middle = (first.areas["mitral"] + second.areas["mitral"]) / 2
    assert np.linalg.norm(now.areas["mitral"] - middle) < 3.0
    on_skin = anchored(now.surface, now.areas["mitral"][None]).on(now.surface.vertices)[0]
    np.testing.assert_allclose(on_skin, now.areas["mitral"], atol=1e-6)
    apart = np.linalg.norm(first.areas["mitral"] - second.areas["mitral"])
    assert now.spread_mm["mitral"] == pytest.approx(apart, abs=0.01)
    assert now.spread_mm["aortic"] == pytest.approx(0.0, abs=0.01)
    assert now.card["placed_by"] == "Dr mori and Dr silva"


def test_the_shipped_bodies_serve_beside_marks_alone_and_stay_as_they_are(girl: Reference, tmp_path: Path) -> None:
    before = load_library().sha256
    for who in ("mori", "silva"):
        write_marks(tmp_path, marks_by(girl, who, SIDEWAYS))
    assert len(load_library(tmp_path).references) == len(load_library().references)
    assert load_library(tmp_path).sha256 != before == load_library().sha256
    assert girl_in(None).spread_mm == {}


@pytest.mark.parametrize("why", ["alone", "at work", "another shape"])
def test_one_marker_is_not_two(girl: Reference, tmp_path: Path, why: str) -> None:
    write_marks(tmp_path, marks_by(girl, "mori", SIDEWAYS))
    second = marks_by(girl, "silva", SIDEWAYS)
    changed = {"at work": replace(second, handed_in_at=""), "another shape": replace(second, body_sha256="0" * 64)}
    if why in changed:
        write_marks(tmp_path, changed[why])
    np.testing.assert_array_equal(girl_in(tmp_path).areas["mitral"], girl.areas["mitral"])
    assert load_library(tmp_path).sha256 == load_library().sha256


def test_marks_taken_away_leave_the_body_as_it_was(girl: Reference, tmp_path: Path) -> None:
    for who in ("mori", "silva"):
        write_marks(tmp_path, marks_by(girl, who, SIDEWAYS))
    states = [state_of(tmp_path)]
    assert drop_marks(tmp_path, GIRL, "silva")
    states.append(state_of(tmp_path))
    assert not drop_marks(tmp_path, GIRL, "silva")
    assert girl_in(tmp_path).spread_mm == {}
    write_marks(tmp_path, marks_by(girl, "silva", {}))
    states.append(state_of(tmp_path))
    assert len(set(states)) == 3, "whoever keeps a library in memory sees that it changed"


def test_steps_are_taken_back_one_by_one_and_old_ones_are_forgotten_but_not_where_they_led() -> None:
    marks = AreaMarks(GIRL, "0", "mori", "Dr Mori", "t")
    marks = marks.with_step("aortic", np.array([1.0, 2.0, 3.0]))
    for number in range(500):
        marks = marks.with_step("mitral", np.array([float(number), 0.0, 0.0]))
    assert len(marks.steps) < 250
    assert marks.areas["aortic"].tolist() == [1.0, 2.0, 3.0]
    assert marks.without_last().areas["mitral"][0] == 498.0
    assert marks.without_last().version == 502


def test_marks_come_back_as_they_were_written(girl: Reference, tmp_path: Path) -> None:
    marks = marks_by(girl, "mori", SIDEWAYS)
    write_marks(tmp_path, marks)
    (back,) = read_marks(tmp_path, GIRL)
    assert replace(back, steps=()) == replace(marks, steps=())
    for name, place in marks.areas.items():
        np.testing.assert_allclose(back.areas[name], place, atol=1e-3)


def test_a_torn_file_of_marks_is_said_in_a_sentence(girl: Reference, tmp_path: Path) -> None:
    write_marks(tmp_path, marks_by(girl, "mori", {}))
    (tmp_path / "marks" / GIRL / "mori.json").write_text('{"body": "girl-')
    with pytest.raises(LibraryDamaged, match="marks"):
        load_library(tmp_path)


def test_no_marks_are_written_outside_the_folder(girl: Reference, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no such body"):
        write_marks(tmp_path, replace(marks_by(girl, "mori", {}), body="../girl-06"))
    assert not drop_marks(tmp_path, GIRL, "nobody")
