"""Marking reference bodies: two by themselves, on every database."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lubdub.cases.errors import BodyNotFound, ReviewMoved, StateConflict
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.trail import Trail
from lubdub.jobs.reference_marks import ReferenceMarks
from lubdub.library.load import load_library
from lubdub.library.own import OwnBody, add_body
from lubdub.results import AREA_NAMES, Reference
from tests.cases.conftest import Room, girl_of_six
from tests.cases.conftest import room as room

GIRL = "girl-06"


@dataclass
class Desk:
    """The marks of an installation whose folder of its own begins empty."""

    room: Room
    folder: Path
    marks: ReferenceMarks

    def marked(self, by: Reviewer, name: str = GIRL, aside: float = 0.0) -> None:
        """All four areas, where the body has them or so far to the patient's left, handed in."""
        body = self.marks.body(by, name)
        version = self.marks.mine(by, name).version
        for area in AREA_NAMES:
            place = body.areas[area] + np.array([aside, 0.0, 0.0])
            version = self.marks.place(by, name, version, area, place).version
        self.marks.hand_in(by, name, version)


@pytest.fixture
def desk(room: Room, tmp_path: Path) -> Desk:
    folder = tmp_path / "references"
    marks = ReferenceMarks(room.database, folder, lambda: folder if folder.is_dir() else None)
    return Desk(room, folder, marks)


def girl(desk: Desk) -> Reference:
    return next(one for one in load_library(desk.folder).references if one.id == GIRL)


def test_two_clinicians_marks_replace_the_tables_places(desk: Desk) -> None:
    portal = desk.room.portal()
    mori, silva = (desk.room.clinician(portal, name) for name in ("mori", "silva"))
    desk.marked(mori)
    assert girl(desk).spread_mm == {}
    desk.marked(silva, aside=8.0)
    assert girl(desk).spread_mm["aortic"] == pytest.approx(8.0, abs=0.01)
    told = desk.marks.told(mori, GIRL)
    assert (told.placed_by, told.outside, told.others) == (("mori", "silva"), 0, 1)
    assert told.spread_mm is not None
    assert told.spread_mm["mitral"] == pytest.approx(8.0, abs=0.01)


def test_nobody_is_told_where_another_marked(desk: Desk) -> None:
    portal = desk.room.portal()
    mori, silva = (desk.room.clinician(portal, name) for name in ("mori", "silva"))
    desk.marked(mori, aside=5.0)
    told = desk.marks.told(silva, GIRL)
    assert (told.others, told.mine.areas, told.placed_by, told.spread_mm) == (1, {}, (), None)
    np.testing.assert_array_equal(
        desk.marks.body(silva, GIRL).areas["aortic"], load_library().references[9].areas["aortic"]
    )


def test_a_third_is_not_asked_until_one_withdraws(desk: Desk) -> None:
    portal = desk.room.portal()
    mori, silva, third = (desk.room.clinician(portal, name) for name in ("mori", "silva", "third"))
    desk.marked(mori)
    desk.marked(silva)
    assert desk.marks.told(third, GIRL).is_full
    with pytest.raises(StateConflict, match="already"):
        desk.marked(third)
    desk.marks.withdraw(mori, GIRL)
    assert girl(desk).spread_mm == {}
    desk.marked(third)
    assert girl(desk).card["placed_by"] == "silva and third"


def test_marks_need_all_four_areas_and_are_then_closed(desk: Desk) -> None:
    by = desk.room.clinician(desk.room.portal(), "mori")
    place = desk.marks.body(by, GIRL).areas["aortic"]
    version = desk.marks.place(by, GIRL, 0, "aortic", place).version
    with pytest.raises(StateConflict, match="all four"):
        desk.marks.hand_in(by, GIRL, version)
    with pytest.raises(ReviewMoved):
        desk.marks.place(by, GIRL, 0, "mitral", place)
    version = desk.marks.undo(by, GIRL, version).version
    with pytest.raises(StateConflict, match="nothing"):
        desk.marks.undo(by, GIRL, version)
    desk.marked(by)
    with pytest.raises(StateConflict, match="handed in"):
        desk.marks.place(by, GIRL, desk.marks.mine(by, GIRL).version, "aortic", place)


def test_handing_in_and_withdrawing_stand_in_the_audit_trail(desk: Desk) -> None:
    by = desk.room.clinician(desk.room.portal(), "mori")
    desk.marked(by)
    desk.marks.withdraw(by, GIRL)
    with pytest.raises(StateConflict):
        desk.marks.withdraw(by, GIRL)
    with desk.room.database.reading() as session:
        from lubdub.cases.models import AuditRow

        lines = session.query(AuditRow).filter(AuditRow.action.startswith("reference.")).order_by(AuditRow.sequence)
        said = [(line.actor, line.action, line.detail) for line in lines]
    assert said == [(by.actor.name, "reference.mark", GIRL), (by.actor.name, "reference.withdraw", GIRL)]
    assert Trail(desk.room.database).first_broken_line() is None


def test_a_patients_body_is_shown_to_the_patients_organisation_alone(desk: Desk) -> None:
    portal = desk.room.portal()
    case, _ = desk.room.store.create(portal, girl_of_six())
    heavy = next(one for one in load_library().references if one.id == "girl-08-heavy")
    body = OwnBody(heavy.surface, heavy.landmarks, heavy.areas, 8.0, "female", "Dr. Mori", case.id)
    name = add_body(desk.folder, body)
    ours, theirs = desk.room.clinician(portal), desk.room.clinician(desk.room.portal("elsewhere"), "stranger")
    assert name in [one.card["id"] for one in desk.marks.list_all(ours)]
    assert name not in [one.card["id"] for one in desk.marks.list_all(theirs)]
    desk.marks.note_reading(ours, name)
    for asked in (desk.marks.body, desk.marks.told, desk.marks.note_reading, desk.marks.withdraw):
        with pytest.raises(BodyNotFound):
            asked(theirs, name)


def test_colleagues_of_other_organisations_are_counted_but_not_named(desk: Desk) -> None:
    ours = desk.room.clinician(desk.room.portal(), "mori")
    theirs = desk.room.clinician(desk.room.portal("elsewhere"), "silva")
    desk.marked(ours)
    desk.marked(theirs)
    told = desk.marks.told(ours, GIRL)
    assert (told.placed_by, told.outside) == (("mori",), 1)


@pytest.mark.parametrize("name", ["nobody", "", "../girl-06", "*"])
def test_a_body_that_is_not_there_is_not_found(desk: Desk, name: str) -> None:
    with pytest.raises(BodyNotFound):
        desk.marks.body(desk.room.clinician(desk.room.portal()), name)
