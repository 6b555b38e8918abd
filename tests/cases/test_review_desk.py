"""Clinicians review a result: look, move, undo, sign, give back; on every database."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
import sqlalchemy as sa

from lubdub.cases.audit import first_broken_line
from lubdub.cases.errors import CaseNotFound, ReviewMoved, StateConflict
from lubdub.cases.models_review import ReviewStepRow
from lubdub.cases.review import LONGEST_NOTE, Decision
from lubdub.cases.reviewing import Review, Reviewer
from lubdub.cases.sealed_values import opened
from lubdub.cases.store import Asked
from lubdub.cases.values import Actor
from lubdub.results import AREA_NAMES
from tests.cases.conftest import Room
from tests.cases.test_review import reviews, with_result
from tests.cases.test_store import DONE


def sent(room: Room, actor: Actor | None = None) -> tuple[str, Reviewer]:
    """A case in review, and a clinician who may see it."""
    actor = actor or room.portal()
    case = with_result(room, actor)
    room.store.send_for_review(actor, case.id)
    return case.id, room.clinician(actor)


def look_at_all(room: Room, case: str, by: Reviewer) -> Review:
    review = room.reviews.read(by.actor, case)
    for name in AREA_NAMES:
        review = room.reviews.look(by, case, review.version, name)
    return review


def test_a_signature_needs_all_four_areas_looked_at(room: Room) -> None:
    case, by = sent(room)
    review = room.reviews.look(by, case, 0, "aortic")
    with pytest.raises(StateConflict, match="pulmonary, tricuspid, mitral"):
        room.reviews.sign(by, case, review.version)
    assert room.store.get(by.actor, case).status == "in_review"
    review = look_at_all(room, case, by)
    assert room.reviews.sign(by, case, review.version).status == "reviewed"
    decision = room.reviews.read(by.actor, case).decision
    assert decision is not None
    assert (decision.deed, decision.by_name) == ("sign", "Dr. Mori")


def test_a_colleagues_look_is_no_look_of_ones_own(room: Room) -> None:
    actor = room.portal()
    case, mori = sent(room, actor)
    sato = room.clinician(actor, "Dr. Sato")
    review = look_at_all(room, case, sato)
    with pytest.raises(StateConflict):
        room.reviews.sign(mori, case, review.version)


def test_a_moved_area_lies_beside_the_computed_one(room: Room) -> None:
    case, by = sent(room)
    review = room.reviews.move(by, case, 0, "mitral", (1.0, 2.0, 3.0))
    assert review.corrected["mitral"].position == (1.0, 2.0, 3.0)
    assert review.corrected["mitral"].by_name == "Dr. Mori"
    assert room.vault.read(case, "result.json") == DONE.files["result.json"]
    assert room.vault.read(case, "outcome.npz") == DONE.files["outcome.npz"]


def test_undone_moves_stay_in_the_record(room: Room) -> None:
    case, by = sent(room)
    review = room.reviews.move(by, case, 0, "mitral", (1.0, 2.0, 3.0))
    review = room.reviews.undo(by, case, review.version)
    assert not review.corrected
    assert [step.deed for step in review.steps] == ["move", "undo"]
    with pytest.raises(StateConflict, match="no move"):
        room.reviews.undo(by, case, review.version)


def test_of_two_who_act_at_once_one_is_told_kindly(room: Room) -> None:
    actor = room.portal()
    case, mori = sent(room, actor)
    sato = room.clinician(actor, "Dr. Sato")

    def move(by: Reviewer) -> Review | ReviewMoved:
        try:
            return room.reviews.move(by, case, 0, "aortic", (1.0, 0.0, 0.0))
        except ReviewMoved as moved:
            return moved

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(move, (mori, sato)))
    refused = [one for one in outcomes if isinstance(one, ReviewMoved)]
    assert len(refused) == 1
    assert "Somebody else" in str(refused[0])
    assert len(room.reviews.read(mori.actor, case).steps) == 1
    assert first_broken_line(room.database) is None


def test_a_case_of_another_organisation_does_not_exist(room: Room) -> None:
    case, _ = sent(room)
    stranger = room.clinician(room.portal("elsewhere"))
    with pytest.raises(CaseNotFound):
        room.reviews.read(stranger.actor, case)
    for act in (
        lambda: room.reviews.look(stranger, case, 0, "aortic"),
        lambda: room.reviews.move(stranger, case, 0, "aortic", (0.0, 0.0, 0.0)),
        lambda: room.reviews.sign(stranger, case, 0),
        lambda: room.reviews.give_back(stranger, case, 0, Decision("blurred")),
        lambda: room.reviews.run_again(stranger, case, 0),
    ):
        with pytest.raises(CaseNotFound):
            act()


def test_a_returned_case_can_be_scanned_or_marked_again_and_sent_again(room: Room) -> None:
    actor = room.portal()
    case, by = sent(room, actor)
    note = "  Please hold\nstill. " + "x" * 2 * LONGEST_NOTE
    returned = room.reviews.give_back(by, case, 0, Decision("blurred", note))
    assert returned.status == "returned"
    assert returned.reason is not None
    assert returned.reason["code"] == "blurred"
    decision = room.reviews.read(by.actor, case).decision
    assert decision is not None
    assert decision.said["note"].startswith("Please hold still. xxx")
    assert len(decision.said["note"]) == LONGEST_NOTE
    assert room.store.expect_scan(actor, case)
    again, job = room.store.place_landmarks(actor, case, Asked({}))
    assert again.reason is None
    room.desk.hand_in(job, DONE)
    assert room.store.get(actor, case).status == "done", "the family sends it again by itself"
    room.store.send_for_review(actor, case)
    assert room.reviews.read(by.actor, case).steps == ()


def test_an_unusable_case_takes_nothing_any_more(room: Room) -> None:
    actor = room.portal()
    case, by = sent(room, actor)
    assert room.reviews.mark_unusable(by, case, 0, Decision("wrong_person")).status == "unusable"
    with pytest.raises(StateConflict):
        room.store.expect_scan(actor, case)
    with pytest.raises(StateConflict):
        room.store.place_landmarks(actor, case, Asked({}))
    with pytest.raises(StateConflict):
        room.store.take_back(actor, case)


@pytest.mark.parametrize("code", ["", "other_anatomy", "no such reason"])
def test_a_case_is_given_back_for_a_reason_of_the_list_alone(room: Room, code: str) -> None:
    case, by = sent(room)
    with pytest.raises(ValueError, match="blurred"):
        room.reviews.give_back(by, case, 0, Decision(code))
    assert room.store.get(by.actor, case).status == "in_review"


def test_corrected_landmarks_make_a_new_run_that_comes_back_to_the_review(room: Room) -> None:
    actor = room.portal()
    case, by = sent(room, actor)
    review = room.reviews.move(by, case, 0, "mitral", (1.0, 2.0, 3.0))
    with pytest.raises(StateConflict, match="Move a landmark first"):
        room.reviews.run_again(by, case, review.version)
    review = room.reviews.move_landmark(by, case, review.version, "navel", (4.0, 5.0, 6.0))
    review = look_at_all(room, case, by)
    with pytest.raises(StateConflict, match="run again"):
        room.reviews.sign(by, case, review.version)
    again, job = room.reviews.run_again(by, case, review.version)
    assert (again.status, again.landmarks) == ("queued", {"navel": [4.0, 5.0, 6.0]})
    assert room.desk.take_up(job) is not None
    assert room.desk.hand_in(job, DONE)
    assert room.store.get(actor, case).status == "in_review"
    review = room.reviews.read(by.actor, case)
    assert review.version == 7
    assert not review.corrected, "what was moved belongs to the result it was moved in"
    with room.database.reading() as session:
        kept = session.scalars(sa.select(ReviewStepRow).order_by(ReviewStepRow.number)).all()
        assert [row.deed for row in kept] == ["move", "move", *["look"] * 4, "landmarks"]
        said = opened(session, case, kept[-1].said)
    assert said == {"landmarks": {"navel": [4.0, 5.0, 6.0]}, "before": {}}


def test_a_signed_case_is_closed(room: Room) -> None:
    actor = room.portal()
    case, by = sent(room, actor)
    review = look_at_all(room, case, by)
    room.reviews.sign(by, case, review.version)
    now = room.reviews.read(by.actor, case).version
    with pytest.raises(StateConflict, match="reviewed"):
        room.reviews.move(by, case, now, "mitral", (1.0, 2.0, 3.0))
    with pytest.raises(StateConflict):
        room.store.take_back(actor, case)
    with pytest.raises(StateConflict):
        room.store.place_landmarks(actor, case, Asked({}))


def test_every_act_leaves_one_line_in_the_audit_trail(room: Room) -> None:
    case, by = sent(room)
    review = room.reviews.move(by, case, 0, "mitral", (1.0, 2.0, 3.0))
    room.reviews.undo(by, case, review.version)
    review = look_at_all(room, case, by)
    room.reviews.sign(by, case, review.version)
    assert reviews(room) == ["review.send", "review.move", "review.undo", *["review.look"] * 4, "review.sign"]
    assert first_broken_line(room.database) is None


def test_a_deleted_case_keeps_nothing_of_its_review(room: Room) -> None:
    actor = room.portal()
    case, by = sent(room, actor)
    room.reviews.move(by, case, 0, "mitral", (1.0, 2.0, 3.0))
    room.privacy.delete(actor, case)
    with room.database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(ReviewStepRow)) == 0
