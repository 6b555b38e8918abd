"""What a clinician's review makes of a result: the places to be shown, and the words and members that say so."""

from __future__ import annotations

from typing import Any

import numpy as np

from lubdub.areas.words import instruction
from lubdub.cases.files import FileVault
from lubdub.cases.review import Reviews
from lubdub.cases.reviewing import DECISIONS, Review
from lubdub.cases.values import Actor, Case
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.whereabouts import whereabouts
from lubdub.report.archive import outcome_from_bytes
from lubdub.report.corrected import corrected, corrected_json
from lubdub.results import Outcome

DECIDED = dict(zip(DECISIONS, ("signed", "returned", "unusable"), strict=True))


def with_corrections(outcome: Outcome, review: Review) -> Outcome:
    """The outcome with the areas where clinicians put them so far."""
    return corrected(outcome, {name: one.position for name, one in review.corrected.items()})


def shown_outcome(case: Case, actor: Actor, files: FileVault, reviews: Reviews) -> tuple[Outcome, Review]:
    """What the family or portal is shown: corrections count once they are signed. Raises FileNotFound."""
    outcome = outcome_from_bytes(files.read(case.id, "outcome.npz"))
    if case.status != "reviewed":
        return outcome, Review()
    review = reviews.read(actor, case.id)
    return with_corrections(outcome, review), review


def review_json(outcome: Outcome | None, review: Review) -> dict[str, Any] | None:
    """The member `review` of a result: who decided what, and the areas that were moved. None before a decision."""
    decision = review.decision
    if decision is None:
        return None
    return {
        "decision": DECIDED[decision.deed],
        "by": decision.by_name,
        "at": decision.at.isoformat(),
        "note": decision.said.get("note", ""),
        "areas": {} if outcome is None or decision.deed != "sign" else _areas(outcome, review),
    }


def _areas(outcome: Outcome, review: Review) -> dict[str, Any]:
    if outcome.scan is None or not review.corrected:
        return {}
    moved, skin = with_corrections(outcome, review), SkinCaster(outcome.scan.display)
    mark = outcome.landmarks.get("suprasternal_notch")
    notch = np.zeros(3) if mark is None else mark.position
    return {
        name: {
            **corrected_json(outcome, moved, name),
            "instruction": instruction(whereabouts(skin, moved.areas[name].position, notch)),
            "by": one.by_name,
            "at": one.at.isoformat(),
        }
        for name, one in review.corrected.items()
    }
