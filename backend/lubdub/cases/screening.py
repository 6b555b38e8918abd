"""The three stop questions: what no scan can show, so it is asked before one is taken."""

from __future__ import annotations

from collections.abc import Mapping

from lubdub.cases.values import Answer, StopQuestion
from lubdub.results import PUBERTY_YEARS, Reason, Sex

PREGNANT_BELOW_YEARS = 60.0
"""The oldest known natural birth was at 59."""

STOP_REASONS: dict[StopQuestion, Reason] = {
    "heart_on_right": Reason(
        "heart_on_right",
        "The heart is known to lie on the right side, so the usual listening places do not fit this body.",
        "Ask the clinician who looks after this heart where to listen.",
    ),
    "chest_operation_or_device": Reason(
        "chest_operation_or_device",
        "The places found from the skin can be wrong after a chest operation. A device or an unusual chest shape can "
        "do the same.",
        "Ask the clinician who knows this chest where to listen, and keep clear of wounds and devices.",
    ),
    "late_pregnancy": Reason(
        "late_pregnancy",
        "Late in pregnancy the heart is pushed up and to the side, and the places have not been checked for that.",
        "Ask your midwife or doctor to show you where to listen.",
    ),
}
"""By question, in the order they are asked. Sources: hazards `heart on the right`, `operated chest`."""

_ASK_FIRST = "Ask the clinician about this before you rely on the places shown."

UNSURE_REASONS: dict[StopQuestion, Reason] = {
    "heart_on_right": Reason(
        "unsure_heart_on_right", "Nobody was sure whether the heart lies on the usual, left side.", _ASK_FIRST
    ),
    "chest_operation_or_device": Reason(
        "unsure_chest_operation_or_device",
        "Nobody was sure if the chest was operated on, or has a device or an odd shape.",
        _ASK_FIRST,
    ),
    "late_pregnancy": Reason("unsure_late_pregnancy", "Nobody was sure whether this is a late pregnancy.", _ASK_FIRST),
}


def may_be_pregnant(sex: Sex | None, age_years: float | None) -> bool:
    """Whether a pregnancy is worth asking about; not before both are known."""
    return sex == "female" and age_years is not None and PUBERTY_YEARS <= age_years < PREGNANT_BELOW_YEARS


def stop_reason(answers: Mapping[StopQuestion, Answer]) -> Reason | None:
    """Why no scan should be taken, or None. Only a clear yes stops; "unsure" is shown to the clinician."""
    for question, reason in STOP_REASONS.items():
        if answers.get(question) == "yes":
            return reason
    return None


def unsure_reasons(answers: Mapping[str, str]) -> tuple[Reason, ...]:
    """Why a result is shown with care only: questions nobody was sure about."""
    return tuple(UNSURE_REASONS[question] for question in STOP_REASONS if answers.get(question, "unsure") == "unsure")
