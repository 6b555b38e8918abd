"""One question per page, each answer kept on the server at once; and the page where a clear yes stops the way."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.values import FamilySession
from lubdub.web.deps import DraftsDep, FamilyDep, FormGuard
from lubdub.web.pages.common import STEP_OF, FormDep, go, said
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.pages.questions import QUESTIONS, Answers, Question, asked, person_said, stop_of
from lubdub.web.pages.questions_words import wording_of
from lubdub.web.problems import Problem

CONSENT, CHILD, STOP = "/consent", "/consent/child", "/stop"

router = APIRouter(include_in_schema=False)


@router.get("/ask/{name}")
def ask(name: str, request: Request, family: FamilyDep, drafts: DraftsDep) -> Response:
    """The question, with what was answered before; never one that comes too early."""
    question, answers = _question(name), drafts.read(family)
    early = first_missing(answers)
    if question not in asked(answers):
        return go(next_question(answers))
    if early is not None and QUESTIONS.index(early) < QUESTIONS.index(question):
        return go(f"/ask/{early.name}")
    return _page(request, family, question, answers, {})


@router.post("/ask/{name}", dependencies=[FormGuard])
def answered(name: str, request: Request, family: FamilyDep, form: FormDep, drafts: DraftsDep) -> Response:
    """Keeps the answer and goes on to the next question, or says what is missing."""
    question = _question(name)
    answers = drafts.read(family) | {field: said(form, field)[:200] for field in question.fields}
    errors = question.fault(answers, gettext_of(request))
    if errors:
        return _page(request, family, question, answers, errors)
    drafts.write(family, answers)
    return go(_after(question, answers))


@router.get(STOP)
def stop(request: Request, family: FamilyDep, drafts: DraftsDep) -> Response:
    """Why no scan should be made, kindly. No case was opened."""
    answers, _ = drafts.read(family), gettext_of(request)
    reason = stop_of(answers)
    if reason is None:
        return go(next_question(answers))
    request.state.person = person_said(answers)
    asked_by = next(question for question in asked(answers) if answers.get(question.name) == "yes")
    return render(
        request, "family/ask/stop.html", family, reason=reason, step=STEP_OF["who"], back=f"/ask/{asked_by.name}"
    )


def first_missing(answers: Answers) -> Question | None:
    """The first question without an answer."""
    return next((question for question in asked(answers) if not question.is_answered(answers)), None)


def next_question(answers: Answers) -> str:
    """Where a family with these answers belongs."""
    if stop_of(answers) is not None:
        return STOP
    missing = first_missing(answers)
    if missing is not None:
        return f"/ask/{missing.name}"
    return CHILD if answers.get("consent") else CONSENT


def _after(question: Question, answers: Answers) -> str:
    """The page after this one: in order, so that somebody who went back sees the later questions again."""
    if answers.get(question.name) == "yes" and stop_of(answers) is not None:
        return STOP
    order = asked(answers)
    place = order.index(question)
    return f"/ask/{order[place + 1].name}" if place + 1 < len(order) else next_question(answers)


def _question(name: str) -> Question:
    for question in QUESTIONS:
        if question.name == name:
            return question
    raise Problem("page-not-found", "There is no such question.")


def _page(
    request: Request, family: FamilySession, question: Question, answers: Answers, errors: dict[str, str]
) -> Response:
    request.state.person = person_said(answers)
    order = asked(answers)
    place = order.index(question)
    facts: dict[str, Any] = {
        "question": question,
        "wording": wording_of(question.name, person_said(answers), gettext_of(request)),
        "given": answers,
        "errors": errors,
        "place": place + 1,
        "count": len(order),
        "step": STEP_OF["who"],
        "back": f"/ask/{order[place - 1].name}" if place else "/",
    }
    return render(request, "family/ask/ask.html", family, 422 if errors else 200, **facts)
