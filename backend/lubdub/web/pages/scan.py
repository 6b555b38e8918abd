"""Sending a scan, and saying whether its size and sides are right."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any, cast, get_args

from fastapi import APIRouter, Request
from fastapi.responses import Response
from starlette.datastructures import UploadFile

from lubdub.cases.states import TAKES_LANDMARKS, TAKES_SCAN
from lubdub.cases.values import Case
from lubdub.results import Examination, Reason
from lubdub.web.actions import UnitName
from lubdub.web.deps import ActionsDep, CaseDep, FamilyDep, FormGuard, SettingsDep
from lubdub.web.pages.common import STEP_OF, DeskDep, FormDep, asked_of, before_scan, go, is_unclear, next_path, said
from lubdub.web.pages.look import gettext_of, person_words, render
from lubdub.web.pages.samples import samples_to_try
from lubdub.web.pages.sizes import SizeWords
from lubdub.web.pages.stickers import marked_by_stickers, sheets_for
from lubdub.web.problems import Problem

CHUNK = 1 << 20
UNITS: tuple[str, ...] = get_args(UnitName)

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
        _ = gettext_of(request)
        errors = {"scan": _("Choose the file from your scanning app first.")}
        return _scan_page(request, case, family, settings, errors)
    await actions.receive_scan(family.actor, case.id, _chunks(file))
    return go(f"/cases/{case.id}/checking")


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
    if is_unclear(examination):
        given["side"] = "unsure"  # no picture shows which side is left before the body is turned and marked
    errors = _faults(request, given)
    if errors:
        return _size_page(request, case, family, examination, given, errors)
    reason = stop_for(request, given)
    if reason is not None:
        return _stopped(request, case, reason)
    if given["size"] in UNITS:
        return _checked_again(case, family, given["size"], desk, actions)
    asked = asked_of(case)
    stuck = marked_by_stickers(examination)
    desk.change(case.id, lambda marks: marks.confirmed(asked, stuck))
    return go(f"/cases/{case.id}/points")


@router.post("/cases/{case_id}/unit", dependencies=[FormGuard])
def unit_said(case: CaseDep, family: FamilyDep, form: FormDep, desk: DeskDep, actions: ActionsDep) -> Response:
    """What a scan's file is in, when its size alone did not tell."""
    unit = said(form, "unit")
    if unit not in UNITS:
        raise Problem("bad-request", "The unit must be m, cm or mm.")
    return _checked_again(case, family, unit, desk, actions)


def _checked_again(case: Case, family: FamilyDep, unit: str, desk: DeskDep, actions: ActionsDep) -> Response:
    desk.close(case.id)
    actions.check_again(family.actor, case.id, cast(UnitName, unit))
    return go(f"/cases/{case.id}/checking")


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
    if given["size"] not in ("right", "wrong", *UNITS):
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
        is_unclear=is_unclear(examination),
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
        back=before_scan(case),
    )


async def _chunks(file: UploadFile) -> AsyncIterator[bytes]:
    while chunk := await file.read(CHUNK):
        yield chunk
