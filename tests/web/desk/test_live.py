"""What is open on a clinician's screen ends when its session does: streams and pictures, within moments."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
from datetime import timedelta

import httpx
import pytest
import sqlalchemy as sa

from lubdub.cases.clock import now
from lubdub.cases.models_desk import ClinicianSessionRow
from tests.web.reviewing import ORGANISATION, dial, in_review
from tests.web.service import Service
from tests.web.staff import Desk, signed_in, staff_of

SOON_S = 30
"""Long enough for a busy machine, and far less than any session lasts."""
NOT_FOR_YOU = 1008


def signs_out(desk: Desk) -> None:
    desk.post("/desk/sign-out")


def is_removed(desk: Desk) -> None:
    assert desk.session is not None
    administrator = signed_in(desk.service, "administrator", ORGANISATION)
    administrator.post("/desk/people/disable", clinician=desk.session.clinician.id)


def is_ended_elsewhere(desk: Desk) -> None:
    assert desk.session is not None
    with staff_of(desk.service.settings) as (staff, _database):
        other = Desk(desk.service, staff.sessions.open(desk.session.clinician, "password", "other"))
    assert other.session is not None
    other.http.cookies.set("lubdub-desk", other.session.token)
    other.post("/desk/account/sessions/end-others")


def falls_asleep(desk: Desk) -> None:
    assert desk.session is not None
    with staff_of(desk.service.settings) as (_staff, database), database.writing() as session:
        mine = sa.update(ClinicianSessionRow).where(ClinicianSessionRow.id == desk.session.id)
        session.execute(mine.values(seen_at=now() - timedelta(days=1)))


ENDINGS = {"signed out": signs_out, "removed": is_removed, "ended": is_ended_elsewhere, "idle": falls_asleep}


@pytest.fixture(scope="module")
def case(service: Service) -> str:
    return in_review(service)


@pytest.mark.parametrize("ending", ENDINGS.values(), ids=ENDINGS)
def test_pictures_and_streams_close_when_the_session_ends(
    service: Service, case: str, ending: Callable[[Desk], None]
) -> None:
    desk, window = signed_in(service, "clinician", ORGANISATION), secrets.token_hex(4)
    desk.get(f"/desk/view/{case}/{window}/")

    async def watch() -> tuple[int | None, list[list[str]]]:
        http = httpx.AsyncClient(base_url=service.settings.address, cookies=desk.http.cookies, timeout=60)
        async with http, dial(desk, case, window) as socket:
            opened = asyncio.Event()
            paths = ("/desk/live", f"/desk/cases/{case}/live", "/desk/references/girl-06/live")
            streams = [asyncio.create_task(events(http, path, opened)) for path in paths]
            await asyncio.wait_for(opened.wait(), SOON_S)
            await asyncio.wait_for(socket.recv(), SOON_S)
            assert socket.close_code is None
            await asyncio.to_thread(ending, desk)
            heard = await asyncio.wait_for(asyncio.gather(*streams), SOON_S)
            await asyncio.wait_for(socket.wait_closed(), SOON_S)
            return socket.close_code, heard

    code, heard = asyncio.run(watch())
    assert code == NOT_FOR_YOU
    assert [kinds[-1] for kinds in heard] == ["over"] * 3


async def events(http: httpx.AsyncClient, path: str, opened: asyncio.Event) -> list[str]:
    """The kinds of events of a stream until it ends."""
    kinds = []
    async with http.stream("GET", path) as answer:
        async for line in answer.aiter_lines():
            if line.startswith("event:"):
                kinds.append(line.removeprefix("event:").strip())
                opened.set()
    return kinds


def test_a_picture_of_a_case_that_is_deleted_is_cut_off(service: Service) -> None:
    case = in_review(service)
    desk = signed_in(service, "clinician", ORGANISATION)
    desk.get(f"/desk/view/{case}/0b/")

    async def watch() -> bool:
        async with dial(desk, case, "0b") as socket:
            await asyncio.wait_for(socket.recv(), SOON_S)
            await asyncio.to_thread(service.portal(ORGANISATION).call, "DELETE", f"/cases/{case}", 200)
            await asyncio.wait_for(socket.wait_closed(), SOON_S)
            return socket.close_code is not None

    assert asyncio.run(watch())


def test_looking_at_a_picture_alone_does_not_keep_a_session_awake(service: Service) -> None:
    desk = signed_in(service, "clinician", ORGANISATION)
    assert desk.session is not None
    with staff_of(service.settings) as (staff, database):
        seen = sa.select(ClinicianSessionRow.seen_at).where(ClinicianSessionRow.id == desk.session.id)
        earlier = now() - timedelta(minutes=9)
        with database.writing() as session:
            mine = sa.update(ClinicianSessionRow).where(ClinicianSessionRow.id == desk.session.id)
            session.execute(mine.values(seen_at=earlier))
        assert staff.sessions.is_living(desk.session.id)
        with database.reading() as session:
            assert session.scalar(seen) == earlier
        assert staff.sessions.session_of(desk.session.token) is not None
        with database.reading() as session:
            assert session.scalar(seen) > earlier
