"""Start, who the scan is of, and what a scan cannot show: the questions before a case is opened."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.screening import STOP_REASONS
from lubdub.cases.values import Answer, NewCase, StopQuestion
from lubdub.results import PUBERTY_YEARS
from lubdub.web.deps import ActionsDep, FamilyDep, FormGuard, SettingsDep
from lubdub.web.pages_common import STEP_OF, FormDep, go, said
from lubdub.web.pages_look import gettext_of, remember_who, render
from lubdub.web.pages_samples import samples_to_try

OLDEST_YEARS = 120
ABOUT = ("who", "years", "months", "sex", "posture")

router = APIRouter(include_in_schema=False)


@router.get("/")
def start(request: Request, family: FamilyDep) -> Response:
    """Emergency signs first, then what this is."""
    return render(request, "family/start/start.html", family, samples=samples_to_try(gettext_of(request)))


@router.get("/who")
def who(request: Request, family: FamilyDep) -> Response:
    """Whose chest it is."""
    given = {"who": "child", "posture": "supine"}
    return render(request, "family/who/who.html", family, given=given, step=STEP_OF["who"], back="/")


@router.post("/who", dependencies=[FormGuard])
def who_said(request: Request, family: FamilyDep, form: FormDep) -> Response:
    """Checks the answers and asks what a scan cannot show."""
    given = {name: said(form, name) for name in ABOUT}
    errors = faults_about(given, gettext_of(request))
    if errors:
        facts = {"given": given, "errors": errors, "step": STEP_OF["who"], "back": "/"}
        return render(request, "family/who/who.html", family, 422, **facts)
    return _health(request, family, given, {})


@router.get("/health")
def health_alone() -> Response:
    """The questions follow the first page; nobody starts here."""
    return go("/who")


@router.post("/health", dependencies=[FormGuard])
def health_said(
    request: Request, family: FamilyDep, form: FormDep, actions: ActionsDep, settings: SettingsDep
) -> Response:
    """Opens the case; a clear yes to a stop question refuses it at once."""
    _ = gettext_of(request)
    given = {name: said(form, name) for name in (*ABOUT, *STOP_REASONS)}
    if faults_about(given, _):
        return go("/who")
    errors: dict[str, str] = {
        name: _("Choose one answer.")
        for name in STOP_REASONS
        if given[name] not in ("no", "yes", "unsure") and (name != "late_pregnancy" or asks_pregnancy(given))
    }
    if errors:
        return _health(request, family, given, errors)
    case, _new = actions.open(family.actor, new_case(given))
    return remember_who(go(f"/cases/{case.id}"), "self" if given["who"] == "self" else "child", settings)


def _health(request: Request, family: FamilyDep, given: dict[str, str], errors: dict[str, str]) -> Response:
    return render(
        request,
        "family/health/health.html",
        family,
        422 if errors else 200,
        given=given,
        errors=errors,
        asks_pregnancy=asks_pregnancy(given),
        step=STEP_OF["who"],
        back="/who",
    )


def faults_about(given: dict[str, str], _: Callable[[str], str]) -> dict[str, str]:
    """Field -> what to do about it; empty when all is well."""
    faults = {}
    if given["who"] not in ("child", "self"):
        faults["who"] = _("Choose who the scan is of.")
    if age_years(given) is None:
        faults["years"] = _("Write the age in whole years and months, such as 6 and 0.")
    if given["sex"] not in ("female", "male"):
        faults["sex"] = _("Choose girl or woman, or boy or man.")
    if given["posture"] not in ("supine", "sitting"):
        faults["posture"] = _("Choose how the scan was made.")
    return faults


def age_years(given: dict[str, str]) -> float | None:
    """The age as one number, None when it cannot be one. Months may be left out, and years for a baby."""
    years, months = given["years"], given["months"]
    if not (years or months) or not (years or "0").isdecimal() or not (months or "0").isdecimal():
        return None
    total = int(years or 0) + int(months or 0) / 12
    return total if total <= OLDEST_YEARS and int(months or 0) < 24 else None


def asks_pregnancy(given: dict[str, str]) -> bool:
    """Only of girls and women who may be pregnant."""
    return given["sex"] == "female" and (age_years(given) or 0.0) >= PUBERTY_YEARS


def new_case(given: dict[str, str]) -> NewCase:
    """The checked answers as a case."""
    answers: dict[StopQuestion, Answer] = {
        question: given[question] if given[question] in ("yes", "unsure") else "no"  # type: ignore[misc]
        for question in STOP_REASONS
    }
    return NewCase(
        age_years=age_years(given) or 0.0,
        sex="female" if given["sex"] == "female" else "male",
        posture="sitting" if given["posture"] == "sitting" else "supine",
        answers=answers,
    )
