"""The questions before a case is opened: which are asked of whom, and what is wrong with an answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from lubdub.cases.screening import STOP_REASONS, may_be_pregnant
from lubdub.cases.values import Answer, Consent, NewCase, Person, StopQuestion
from lubdub.results import Reason

OLDEST_YEARS = 120
GROWN_UP_YEARS = 18
MONTHS_TYPED = 24
"""Ages of babies are often said in months, up to about so many."""

Answers = Mapping[str, str]
Gettext = Callable[[str], str]


@dataclass(frozen=True)
class Question:
    """One page. fields: what it asks for; choices: what its only field may be, empty for the age."""

    name: str
    fields: tuple[str, ...]
    choices: tuple[str, ...] = ()
    is_asked: Callable[[Answers], bool] = lambda answers: True

    def is_answered(self, answers: Answers) -> bool:
        """Whether there is an answer that can be used."""
        if self.choices:
            return answers.get(self.name, "") in self.choices
        return age_years(answers) is not None

    def fault(self, answers: Answers, _: Gettext) -> dict[str, str]:
        """Field -> what to do about it; empty when all is well."""
        if self.is_answered(answers):
            return {}
        if not self.choices:
            return {"years": _("Write the age in whole years and months, such as 6 and 0.")}
        return {self.name: _("Choose one answer.")}


def age_years(answers: Answers) -> float | None:
    """The age as one number, None when it cannot be one. Months may be left out, and years for a baby."""
    years, months = answers.get("years", ""), answers.get("months", "")
    if not (years or months) or not (years or "0").isdecimal() or not (months or "0").isdecimal():
        return None
    total = int(years or 0) + int(months or 0) / 12
    return total if total <= OLDEST_YEARS and int(months or 0) < MONTHS_TYPED else None


def _may_be_pregnant(answers: Answers) -> bool:
    sex = answers.get("sex")
    return may_be_pregnant("female" if sex == "female" else None, age_years(answers))


YES_NO_UNSURE = ("no", "yes", "unsure")

QUESTIONS: tuple[Question, ...] = (
    Question("who", ("who",), ("child", "self", "other")),
    Question("age", ("years", "months")),
    Question("sex", ("sex",), ("female", "male")),
    Question("heart_on_right", ("heart_on_right",), YES_NO_UNSURE),
    Question("chest_operation_or_device", ("chest_operation_or_device",), YES_NO_UNSURE),
    Question("late_pregnancy", ("late_pregnancy",), YES_NO_UNSURE, _may_be_pregnant),
    Question("posture", ("posture",), ("supine", "sitting")),
)


def asked(answers: Answers) -> list[Question]:
    """The questions for this person, in order."""
    return [question for question in QUESTIONS if question.is_asked(answers)]


def stop_of(answers: Answers) -> Reason | None:
    """Why no scan should be taken: the first stop question, of those asked, with a clear yes."""
    names = {question.name for question in asked(answers)}
    for name, reason in STOP_REASONS.items():
        if name in names and answers.get(name) == "yes":
            return reason
    return None


def person_said(answers: Answers) -> Person:
    """Whom the pages speak of. Somebody's grown-up child is not spoken of as a child."""
    who = answers.get("who")
    if who == "self":
        return "self"
    is_grown_up = (age_years(answers) or 0.0) >= GROWN_UP_YEARS
    return "other" if who == "other" or is_grown_up else "child"


def new_case(answers: Answers, consent: Consent) -> NewCase:
    """The checked answers as a case. A stop question that was not asked counts as no."""
    names = {question.name for question in asked(answers)}
    stops: dict[StopQuestion, Answer] = {
        name: answers[name] if name in names and answers[name] in ("yes", "unsure") else "no"  # type: ignore[misc]
        for name in STOP_REASONS
    }
    return NewCase(
        age_years=age_years(answers) or 0.0,
        sex="female" if answers["sex"] == "female" else "male",
        posture="sitting" if answers["posture"] == "sitting" else "supine",
        answers=stops,
        person=person_said(answers),
        consent=consent,
    )
