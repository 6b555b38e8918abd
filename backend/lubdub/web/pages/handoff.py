"""From computer to phone and back: a picture code moves a case to another device, once, within ten minutes."""

from __future__ import annotations

from urllib.parse import urlsplit

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response

from lubdub.cases.errors import LinkSpent
from lubdub.cases.links import LASTS
from lubdub.settings import Settings, is_loopback
from lubdub.web.deps import CaseDep, FamilyDep, FormGuard, LinksDep, SettingsDep
from lubdub.web.desk.codes import qr_svg
from lubdub.web.pages.common import DeskDep, FormDep, go, said
from lubdub.web.pages.look import gettext_of, render

router = APIRouter(include_in_schema=False)


@router.get("/cases/{case_id}/handoff")
def explained(request: Request, case: CaseDep, family: FamilyDep, settings: SettingsDep) -> Response:
    """What moving to another device means. Looking at this page changes nothing."""
    return render(
        request,
        "family/handoff/offer.html",
        family,
        case_id=case.id,
        is_here_only=_is_here_only(settings),
        minutes=_minutes(),
        back=f"/cases/{case.id}",
    )


@router.post("/cases/{case_id}/handoff", dependencies=[FormGuard])
def offered(request: Request, case: CaseDep, family: FamilyDep, links: LinksDep, settings: SettingsDep) -> Response:
    """The picture code, and the same code to type. An earlier one stops working."""
    code = links.offer(family.actor, case.id).code
    return render(
        request,
        "family/handoff/code.html",
        family,
        case_id=case.id,
        code=code,
        picture=qr_svg(f"{settings.address}/handoff#{code}"),
        address=f"{settings.address}/handoff",
        is_here_only=_is_here_only(settings),
        minutes=_minutes(),
        back=f"/cases/{case.id}/handoff",
    )


@router.get("/cases/{case_id}/handoff/state")
def still_here(case: CaseDep) -> JSONResponse:
    """Answers as long as the case is this browser's; 404 once another one has it."""
    return JSONResponse({"status": case.status})


@router.get("/handoff")
def arrived(request: Request, family: FamilyDep) -> Response:
    """Where the picture code leads. The code is in the part of the address that browsers do not send."""
    return _arrived(request, family, "", {})


@router.post("/handoff", dependencies=[FormGuard])
def taken(request: Request, family: FamilyDep, form: FormDep, links: LinksDep, desk: DeskDep) -> Response:
    """Moves the case into this browser. Only this button does: programs that follow links change nothing."""
    _ = gettext_of(request)
    code = said(form, "code")
    if not code:
        return _arrived(request, family, code, {"code": _("Type the code that the other device shows.")})
    try:
        case = links.take(family.actor, code)
    except LinkSpent:
        spent = _("This code does not work. It works once and for ten minutes. Ask the other device for a new one.")
        return _arrived(request, family, code, {"code": spent})
    desk.close(case.id)
    return go(f"/cases/{case.id}")


def _arrived(request: Request, family: FamilyDep, code: str, errors: dict[str, str]) -> Response:
    return render(
        request, "family/handoff/take.html", family, 422 if errors else 200, code=code, errors=errors, back="/"
    )


def _is_here_only(settings: Settings) -> bool:
    return is_loopback(urlsplit(settings.address).hostname or "")


def _minutes() -> int:
    return round(LASTS.total_seconds() / 60)
