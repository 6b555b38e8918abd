"""The first page, going on where one was, starting anew, and the made-up samples."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response
from starlette.concurrency import run_in_threadpool

from lubdub.cases.values import Case
from lubdub.web.deps import ActionsDep, DraftsDep, FamilyDep, FormGuard, StaffDep, StoreDep
from lubdub.web.pages.ask import next_question
from lubdub.web.pages.common import DeskDep, FormDep, go, said
from lubdub.web.pages.look import gettext_of, render
from lubdub.web.pages.samples import sample, samples_to_try

SHOWN_AT_MOST = 5

router = APIRouter(include_in_schema=False)


@router.get("/")
def start(request: Request, family: FamilyDep, drafts: DraftsDep, store: StoreDep, staff: StaffDep) -> Response:
    """Emergency signs first, then what this is; and the way back to what was begun."""
    answers = drafts.read(family)
    invited = staff.families.waiting_for(family.actor)
    return render(
        request,
        "family/start/start.html",
        family,
        samples=samples_to_try(gettext_of(request)),
        invited_by=invited.organisation if invited else "",
        begun=next_question(answers) if answers else None,
        cases=[_in_words(request, case) for case in store.list_cases(family.actor, SHOWN_AT_MOST)],
    )


@router.post("/anew", dependencies=[FormGuard])
def anew(family: FamilyDep, drafts: DraftsDep) -> Response:
    """Forgets the answers so far and asks from the first question. Open cases stay."""
    drafts.forget(family)
    return go("/ask/who")


@router.post("/samples", dependencies=[FormGuard])
async def sample_chosen(family: FamilyDep, form: FormDep, actions: ActionsDep, desk: DeskDep) -> Response:
    """A made-up body instead of a scan: a case of its own, with that body's age and sex."""
    chosen = sample(said(form, "name"))
    case, _new = await run_in_threadpool(actions.open, family.actor, chosen.patient)
    await actions.receive_scan(family.actor, case.id, chosen.chunks())
    await run_in_threadpool(desk.change, case.id, lambda marks: marks.with_known(chosen.landmarks))
    return go(f"/cases/{case.id}/checking")


def _in_words(request: Request, case: Case) -> dict[str, Any]:
    """A case as its family finds it again: whose it is, where it stands, and the way there."""
    _ = gettext_of(request)
    states = {
        "awaiting_scan": _("The scan is still to be made or sent."),
        "checking": _("We are looking at the scan."),
        "awaiting_landmarks": _("The scan has arrived. Some questions are left."),
        "queued": _("We are finding the four places."),
        "running": _("We are finding the four places."),
        "done": _("The four places are ready."),
        "in_review": _("The result was sent. A clinician will look at it."),
        "reviewed": _("A clinician has checked the four places."),
        "returned": _("A clinician asks you to do something again. See what."),
        "unusable": _("A clinician says not to use these places. See why."),
        "refused": _("We stopped, to be safe. See why."),
        "failed": _("Something went wrong on our side. See what to do."),
    }
    whose = {
        "child": _("Your child"),
        "self": _("You"),
        "other": _("The person you look after"),
        "sample": _("A sample"),
    }
    return {"id": case.id, "whose": whose[case.person], "state": states.get(case.status, "")}
