"""Consent in plain words, of the one who decides and of the child; only then a case is opened."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request
from fastapi.responses import Response

from lubdub.cases.values import Consent, FamilySession
from lubdub.web.deps import ActionsDep, DraftsDep, FamilyDep, FormGuard, SettingsDep, StaffDep
from lubdub.web.languages import language_of
from lubdub.web.pages.ask import CHILD, CONSENT, first_missing, next_question
from lubdub.web.pages.common import STEP_OF, FormDep, go, said
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.pages.questions import GROWN_UP_YEARS, Answers, age_years, asked, new_case, person_said, stop_of

CONSENT_VERSION = "1"
"""Of the words on both pages. Count up when what is agreed to changes. Invited families read one sentence more."""
ASKED_FROM_YEARS = 3.0
"""Younger children are not asked in words; whoever holds them watches how they feel."""
SCHOOL_YEARS, TEEN_YEARS = 7.0, 12.0
ALONE_FROM_YEARS = 16.0
"""Younger people who scan themselves are asked to have a grown-up beside them."""

router = APIRouter(include_in_schema=False)


def _told(family: FamilyDep, staff: StaffDep, settings: SettingsDep) -> dict[str, Any]:
    """What the page says of this service: after how many days it deletes, and who asked for the scan, if anybody."""
    invited = staff.families.waiting_for(family.actor)
    return {"days": round(settings.retention_days), "invited_by": invited.organisation if invited else ""}


ToldDep = Annotated[dict[str, Any], Depends(_told)]


@router.get(CONSENT)
def consent(request: Request, family: FamilyDep, drafts: DraftsDep, told: ToldDep) -> Response:
    """What happens with the scan, and a box to tick."""
    answers = drafts.read(family)
    if is_too_early(answers):
        return go(next_question(answers))
    return _consent_page(request, family, answers, told, {})


@router.post(CONSENT, dependencies=[FormGuard])
def consented(
    request: Request, family: FamilyDep, form: FormDep, drafts: DraftsDep, actions: ActionsDep, told: ToldDep
) -> Response:
    """Keeps the yes with its version, language and time; without a child to ask, the case is opened."""
    answers = drafts.read(family)
    if is_too_early(answers):
        return go(next_question(answers))
    if said(form, "agree") != "yes":
        _ = gettext_of(request)
        errors = {"agree": _("Tick the box if you agree. If you do not, you can stop here.")}
        return _consent_page(request, family, answers, told, errors)
    answers |= {
        "consent": f"{CONSENT_VERSION}-invited" if told["invited_by"] else CONSENT_VERSION,
        "consent_language": language_of(request),
        "consent_at": datetime.now(UTC).isoformat(),
    }
    drafts.write(family, answers)
    return go(CHILD) if person_said(answers) == "child" else _open(family, answers, None, drafts, actions)


@router.get(CHILD)
def child(request: Request, family: FamilyDep, drafts: DraftsDep) -> Response:
    """Words to read out to the child, by age, or what to watch in one who is too young."""
    answers = drafts.read(family)
    if is_too_early(answers) or not answers.get("consent") or person_said(answers) != "child":
        return go(CONSENT)
    return _child_page(request, family, answers, {})


@router.post(CHILD, dependencies=[FormGuard])
def child_said(request: Request, family: FamilyDep, form: FormDep, drafts: DraftsDep, actions: ActionsDep) -> Response:
    """A yes opens the case; a no is respected."""
    answers = drafts.read(family)
    if is_too_early(answers) or not answers.get("consent") or person_said(answers) != "child":
        return go(CONSENT)
    choice = said(form, "child")
    if choice == "no":
        return go("/not-now")
    if choice != "yes":
        _ = gettext_of(request)
        return _child_page(request, family, answers, {"child": _("Choose one answer.")})
    is_young = (age_years(answers) or 0.0) < ASKED_FROM_YEARS
    return _open(family, answers, "too_young" if is_young else "agreed", drafts, actions)


@router.get("/not-now")
def not_now(request: Request, family: FamilyDep, drafts: DraftsDep) -> Response:
    """A no is a good answer; nothing was sent."""
    answers = drafts.read(family)
    request.state.person = person_said(answers)
    return render(request, "family/consent/not_now.html", family, back=next_question(answers))


def is_too_early(answers: Answers) -> bool:
    """Whether a question is still open or a clear yes has stopped the way."""
    return first_missing(answers) is not None or stop_of(answers) is not None


def _open(
    family: FamilySession, answers: Mapping[str, str], child_says: Any, drafts: DraftsDep, actions: ActionsDep
) -> Response:
    given = Consent(
        version=answers["consent"],
        language=answers["consent_language"],
        given_at=datetime.fromisoformat(answers["consent_at"]),
        child=child_says,
    )
    case, _new = actions.open(family.actor, new_case(answers, given))
    drafts.forget(family)
    return go(f"/cases/{case.id}")


def _consent_page(
    request: Request, family: FamilySession, answers: Answers, told: dict[str, Any], errors: dict[str, str]
) -> Response:
    person = person_said(answers)
    request.state.person = person
    facts: dict[str, Any] = {
        "person_kind": person,
        "needs_grown_up": person == "self" and (age_years(answers) or 0.0) < ALONE_FROM_YEARS,
        "is_grown_up": (age_years(answers) or 0.0) >= GROWN_UP_YEARS,
        **told,
        "errors": errors,
        "step": STEP_OF["consent"],
        "back": f"/ask/{asked(answers)[-1].name}",
    }
    return render(request, "family/consent/consent.html", family, 422 if errors else 200, **facts)


def _child_page(request: Request, family: FamilySession, answers: Answers, errors: dict[str, str]) -> Response:
    age = age_years(answers) or 0.0
    request.state.person = "child"
    limits = ((ASKED_FROM_YEARS, "baby"), (SCHOOL_YEARS, "small"), (TEEN_YEARS, "school"))
    stage = next((name for limit, name in limits if age < limit), "teen")
    facts = {"stage": stage, "errors": errors, "step": STEP_OF["consent"], "back": CONSENT}
    return render(request, "family/consent/child.html", family, 422 if errors else 200, **facts)
