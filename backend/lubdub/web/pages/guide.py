"""How to make the scan: by the phone and app at hand, then how to get ready. Read before a scan is sent."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.values import Case, Guide
from lubdub.web.deps import CaseDep, FamilyDep, FormGuard, StoreDep
from lubdub.web.pages.common import STEP_OF, FormDep, go, said
from lubdub.web.pages.guide_words import APPS, app_cards, words_of_app
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.pages.samples import samples_to_try
from lubdub.web.pages.stickers import sheets_for
from lubdub.web.problems import Problem

router = APIRouter(include_in_schema=False)


@router.get("/cases/{case_id}/guide")
def guide(request: Request, case: CaseDep, family: FamilyDep) -> Response:
    """Asks which app there is."""
    return _choice(request, case, family, {})


@router.post("/cases/{case_id}/guide", dependencies=[FormGuard])
def app_chosen(request: Request, case: CaseDep, family: FamilyDep, form: FormDep, store: StoreDep) -> Response:
    """Remembers the app and shows its steps."""
    app = said(form, "app")
    if app not in APPS:
        _ = gettext_of(request)
        return _choice(request, case, family, {"app": _("Choose the one that fits best.")})
    store.note_guide(family.actor, case.id, Guide(app, case.guide.is_read))
    return go(f"/cases/{case.id}/guide/{app}")


@router.get("/cases/{case_id}/guide/{app}")
def steps(app: str, request: Request, case: CaseDep, family: FamilyDep) -> Response:
    """One app's way from opening it to a file."""
    if app not in APPS:
        raise Problem("page-not-found", "There are no instructions for this app.")
    _ = gettext_of(request)
    return render(
        request,
        "family/guide/app.html",
        family,
        case_id=case.id,
        app=words_of_app(app, _),
        sheets=sheets_for(case),
        samples=samples_to_try(_),
        step=STEP_OF["prepare"],
        back=f"/cases/{case.id}/guide",
    )


@router.get("/cases/{case_id}/ready")
def ready(request: Request, case: CaseDep, family: FamilyDep) -> Response:
    """How to get the person, the room and the phone ready."""
    app = case.guide.app
    return render(
        request,
        "family/guide/ready.html",
        family,
        case_id=case.id,
        person_kind=case.person,
        posture=case.posture,
        is_baby=case.age_years is not None and case.age_years < 1,
        sheets=sheets_for(case),
        step=STEP_OF["prepare"],
        back=f"/cases/{case.id}/guide/{app}" if app else f"/cases/{case.id}/guide",
    )


@router.post("/cases/{case_id}/ready", dependencies=[FormGuard])
def guide_read(case: CaseDep, family: FamilyDep, store: StoreDep) -> Response:
    """Goes on to sending the scan, and comes back there from now on."""
    store.note_guide(family.actor, case.id, Guide(case.guide.app, is_read=True))
    return go(f"/cases/{case.id}/scan")


def _choice(request: Request, case: Case, family: FamilyDep, errors: dict[str, str]) -> Response:
    return render(
        request,
        "family/guide/guide.html",
        family,
        422 if errors else 200,
        case_id=case.id,
        apps=app_cards(gettext_of(request)),
        chosen=case.guide.app,
        errors=errors,
        step=STEP_OF["prepare"],
        back="/",
    )
