"""Sending a scan, waiting for its check, and saying whether size and sides are right."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile

from lubdub.cases.states import IN_WORK, TAKES_LANDMARKS, TAKES_SCAN
from lubdub.cases.values import Case
from lubdub.results import Examination, Reason
from lubdub.web.actions import UnitName
from lubdub.web.deps import ActionsDep, CaseDep, FamilyDep, FormGuard, SettingsDep
from lubdub.web.pages_common import STEP_OF, DeskDep, FormDep, asked_of, go, next_path, said
from lubdub.web.pages_look import gettext_of, person_words, remember_who, render
from lubdub.web.pages_samples import sample, samples_to_try
from lubdub.web.pages_sizes import SizeWords
from lubdub.web.pages_stickers import marked_by_stickers, sheets_for

CHUNK = 1 << 20

router = APIRouter(include_in_schema=False)


@router.get("/cases/{case_id}")
def where(case: CaseDep, desk: DeskDep) -> Response:
    """On to the page this case belongs on."""
    return go(next_path(case, desk.marks(case.id)))


@router.get("/cases/{case_id}/scan")
def scan(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep, settings: SettingsDep) -> Response:
    """Asks for the file."""
    if case.status not in TAKES_SCAN:
        return go(next_path(case, desk.marks(case.id)))
    return _scan_page(request, case, family, settings)


@router.post("/cases/{case_id}/scan", dependencies=[FormGuard])
async def scan_sent(
    request: Request, case: CaseDep, family: FamilyDep, form: FormDep, actions: ActionsDep, settings: SettingsDep
) -> Response:
    """The file, from a browser without scripts; with them it is streamed by REST."""
    file = form.get("scan")
    if not isinstance(file, UploadFile) or not file.size:
        errors = {"scan": gettext_of(request)("Choose the file from your scanning app first.")}
        return _scan_page(request, case, family, settings, errors)
    await actions.receive_scan(family.actor, case.id, _chunks(file))
    return go(f"/cases/{case.id}/checking")


@router.post("/samples", dependencies=[FormGuard])
async def sample_chosen(
    family: FamilyDep, form: FormDep, actions: ActionsDep, desk: DeskDep, settings: SettingsDep
) -> Response:
    """A made-up body instead of a scan: a case of its own, with that body's age and sex."""
    chosen = sample(said(form, "name"))
    case, _new = await run_in_threadpool(actions.open, family.actor, chosen.patient)
    await actions.receive_scan(family.actor, case.id, chosen.chunks())
    await run_in_threadpool(desk.change, case.id, lambda marks: marks.with_known(chosen.landmarks))
    return remember_who(go(f"/cases/{case.id}/checking"), "sample", settings)


@router.get("/cases/{case_id}/checking")
@router.get("/cases/{case_id}/waiting")
def working(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep) -> Response:
    """What is being done, live."""
    path = next_path(case, desk.marks(case.id))
    if case.status not in IN_WORK or request.url.path != path:
        return go(path)
    _ = gettext_of(request)
    is_check = case.status == "checking"
    return render(
        request,
        "family/checking/checking.html",
        family,
        case_id=case.id,
        heading=_("Looking at the scan") if is_check else _("Finding the four places"),
        lead=_("We check whether it shows a chest, and how big it is.")
        if is_check
        else _("We bend a reference body onto this chest and carry its four places over."),
        stage=stage_words(request, case),
        fraction=case.fraction,
        step=STEP_OF["scan" if is_check else "result"],
    )


@router.get("/cases/{case_id}/state")
def state(request: Request, case: CaseDep, desk: DeskDep) -> JSONResponse:
    """The same in short, for the page's script."""
    words = stage_words(request, case)
    return JSONResponse({"stage": words, "fraction": case.fraction, "next": next_path(case, desk.marks(case.id))})


@router.post("/cases/{case_id}/cancel", dependencies=[FormGuard])
def cancelled(case: CaseDep, family: FamilyDep, actions: ActionsDep) -> Response:
    """Stops the work; the case steps back."""
    if case.status in IN_WORK:
        actions.cancel(family.actor, case.id)
    return go(f"/cases/{case.id}")


@router.get("/cases/{case_id}/size")
def size(request: Request, case: CaseDep, family: FamilyDep, desk: DeskDep) -> Response:
    """Says the size and shows the sides, to be confirmed."""
    if case.status not in TAKES_LANDMARKS or not case.is_checked:
        return go(next_path(case, desk.marks(case.id)))
    return _size_page(request, case, family, desk.examination(case.id), {}, {})


@router.post("/cases/{case_id}/size", dependencies=[FormGuard])
def size_said(
    request: Request, case: CaseDep, family: FamilyDep, form: FormDep, desk: DeskDep, actions: ActionsDep
) -> Response:
    """Goes on when both are right; examines again in another unit; stops for a swapped scan."""
    given = {name: said(form, name) for name in ("size", "side", "mirror")}
    examination = desk.examination(case.id)
    errors = _faults(request, given)
    if errors:
        return _size_page(request, case, family, examination, given, errors)
    reason = stop_for(request, given)
    if reason is not None:
        return _stopped(request, case, reason)
    if given["size"] in ("m", "cm", "mm"):
        unit: UnitName = given["size"]  # type: ignore[assignment]
        desk.close(case.id)
        actions.check_again(family.actor, case.id, unit)
        return go(f"/cases/{case.id}/checking")
    asked = asked_of(case)
    stuck = marked_by_stickers(examination)
    desk.change(case.id, lambda marks: marks.confirmed(asked, stuck))
    return go(f"/cases/{case.id}/points")


def stage_words(request: Request, case: Case) -> str:
    """The stage in a few plain words."""
    _ = gettext_of(request)
    if case.status == "queued":
        return _("Waiting for our turn")
    words = {
        "read": _("Reading the file"),
        "clean": _("Finding the chest in the scan"),
        "fit": _("Bending a reference body onto it"),
        "choose": _("Comparing with reference bodies"),
        "project": _("Carrying the places over"),
        "judge": _("Checking whether we can be sure"),
    }
    return words.get(case.stage or "", _("Starting"))


def stop_for(request: Request, given: dict[str, str]) -> Reason | None:
    """Why this scan cannot be used, from what was said about its size and sides."""
    _ = gettext_of(request)
    if given["side"] == "swapped" or (given["side"] == "unsure" and given["mirror"] != "no"):
        return Reason(
            "mirrored_scan",
            _("Left and right may be swapped in this scan, and the heart is not the same on both sides."),
            _("Scan again with the back camera, no mirror, and nothing flipped in the app. Then send the new scan."),
        )
    if given["size"] == "wrong":
        return Reason(
            "size_wrong",
            _("The size of this scan is not true, so no distance in it can be trusted."),
            _("Use a scanning app that measures depth (LiDAR or TrueDepth), and send that scan."),
        )
    return None


def _faults(request: Request, given: dict[str, str]) -> dict[str, str]:
    _ = gettext_of(request)
    faults = {}
    if given["size"] not in ("right", "wrong", "m", "cm", "mm"):
        faults["size"] = _("Say whether the size is right.")
    if given["side"] not in ("left", "swapped", "unsure"):
        faults["side"] = _("Say which side is the left one.")
    elif given["side"] == "unsure" and given["mirror"] not in ("yes", "no"):
        faults["mirror"] = _("Say how the scan was made.")
    return faults


def _stopped(request: Request, case: Case, reason: Reason) -> Response:
    _ = gettext_of(request)
    actions = [
        {"href": f"/cases/{case.id}/scan", "words": _("Send another scan")},
        {"href": f"/cases/{case.id}/size", "words": _("I made a mistake: go back")},
    ]
    facts: dict[str, Any] = {
        "case_id": case.id,
        "heading": _("We stop here, to be safe"),
        "reason": reason,
        "others": [],
        "closing": "",
        "actions": actions,
        "step": STEP_OF["size"],
    }
    return render(request, "family/refused/refused.html", **facts)


def _size_page(
    request: Request,
    case: Case,
    family: FamilyDep,
    examination: Examination,
    given: dict[str, str],
    errors: dict[str, str],
) -> Response:
    sizes = SizeWords(examination, gettext_of(request))
    return render(
        request,
        "family/size/size.html",
        family,
        422 if errors else 200,
        case_id=case.id,
        size_words=sizes.question(),
        other_sizes=sizes.others(),
        warnings=examination.warnings,
        stickers=examination.stickers,
        given=given,
        errors=errors,
        step=STEP_OF["size"],
        back=f"/cases/{case.id}/scan",
    )


def _scan_page(
    request: Request, case: Case, family: FamilyDep, settings: SettingsDep, errors: dict[str, str] | None = None
) -> Response:
    return render(
        request,
        "family/scan/scan.html",
        family,
        422 if errors else 200,
        case_id=case.id,
        errors=errors or {},
        samples=samples_to_try(gettext_of(request)),
        max_mb=settings.max_upload_mb,
        words=person_words(request),
        sheets=sheets_for(case),
        step=STEP_OF["scan"],
    )


async def _chunks(file: UploadFile) -> AsyncIterator[bytes]:
    while chunk := await file.read(CHUNK):
        yield chunk
