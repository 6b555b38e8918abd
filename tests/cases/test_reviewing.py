"""What clinicians' acts, read in order, amount to."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from lubdub.cases.reviewing import Deed, Reviewer, ReviewStep, review_of
from lubdub.cases.values import Actor
from lubdub.results import AREA_NAMES

MORI = Reviewer(Actor("clinician", "mori", "t"), "Dr. Mori")
SATO = Reviewer(Actor("clinician", "sato", "t"), "Dr. Sato")
RUN = "case.locate.1"
AT = datetime(2026, 1, 2, tzinfo=UTC)


class Acts:
    """A case's steps, one after the other."""

    def __init__(self) -> None:
        self.steps: list[ReviewStep] = []

    def add(self, deed: Deed, by: Reviewer = MORI, run: str = RUN, **said: Any) -> None:
        self.steps.append(ReviewStep(len(self.steps) + 1, run, deed, by.actor.name, by.name, AT, said))


def test_nothing_is_seen_and_nothing_moved_before_the_first_act() -> None:
    review = review_of([], RUN)
    assert review.version == 0
    assert review.unseen_by(MORI.actor) == AREA_NAMES
    assert not review.corrected
    assert review.last_move is None


def test_each_clinician_looks_with_their_own_eyes() -> None:
    acts = Acts()
    acts.add("look", area="aortic")
    acts.add("move", area="mitral", position=[1, 2, 3])
    review = review_of(acts.steps, RUN)
    assert review.unseen_by(MORI.actor) == ("pulmonary", "tricuspid")
    assert review.unseen_by(SATO.actor) == AREA_NAMES


def test_an_area_moved_by_another_must_be_looked_at_again() -> None:
    acts = Acts()
    for name in AREA_NAMES:
        acts.add("look", area=name)
    acts.add("move", by=SATO, area="aortic", position=[1, 2, 3])
    review = review_of(acts.steps, RUN)
    assert review.unseen_by(MORI.actor) == ("aortic",)
    acts.add("undo", area="aortic")
    assert review_of(acts.steps, RUN).unseen_by(MORI.actor) == ()
    assert "aortic" in review_of(acts.steps, RUN).unseen_by(SATO.actor)


def test_undo_puts_the_last_move_back_to_the_one_before_it() -> None:
    acts = Acts()
    acts.add("move", area="mitral", position=[1, 0, 0])
    acts.add("move", area="mitral", position=[2, 0, 0])
    acts.add("move", area="aortic", position=[3, 0, 0])
    assert review_of(acts.steps, RUN).last_move == {"area": "aortic"}
    acts.add("undo", area="aortic")
    acts.add("undo", area="mitral")
    review = review_of(acts.steps, RUN)
    assert {name: one.position for name, one in review.corrected.items()} == {"mitral": (1.0, 0.0, 0.0)}
    acts.add("undo", area="mitral")
    review = review_of(acts.steps, RUN)
    assert not review.corrected
    assert review.last_move is None


def test_a_moved_landmark_waits_for_a_run_and_hides_no_look_at_an_area() -> None:
    acts = Acts()
    acts.add("look", area="aortic")
    acts.add("move", landmark="navel", position=[1, 2, 3])
    review = review_of(acts.steps, RUN)
    assert review.landmarks["navel"].position == (1.0, 2.0, 3.0)
    assert not review.corrected
    assert "aortic" not in review.unseen_by(MORI.actor)
    acts.add("undo", landmark="navel")
    assert not review_of(acts.steps, RUN).landmarks


def test_a_new_run_begins_a_new_review_and_the_version_goes_on() -> None:
    acts = Acts()
    acts.add("move", area="mitral", position=[1, 0, 0])
    acts.add("landmarks", landmarks={})
    acts.add("look", run="case.locate.2", area="aortic")
    review = review_of(acts.steps, "case.locate.2")
    assert review.version == 3
    assert not review.corrected
    assert [step.deed for step in review.steps] == ["look"]


def test_a_decision_ends_it() -> None:
    acts = Acts()
    acts.add("look", area="aortic")
    assert review_of(acts.steps, RUN).decision is None
    acts.add("return", reason="blurred", note="Please hold still")
    decision = review_of(acts.steps, RUN).decision
    assert decision is not None
    assert (decision.deed, decision.by_name, decision.said["note"]) == ("return", "Dr. Mori", "Please hold still")
