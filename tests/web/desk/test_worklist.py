"""The desk's list of cases."""

from __future__ import annotations

import asyncio
import json
import secrets

import httpx
import pytest

from tests.web.reviewing import Hand, in_review
from tests.web.service import Service
from tests.web.staff import Desk, signed_in


@pytest.fixture
def desk(service: Service) -> Desk:
    """Of an organisation of its own: its list is empty."""
    return signed_in(service, "clinician", f"House {secrets.token_hex(4)}")


def organisation(desk: Desk) -> str:
    assert desk.session is not None
    return desk.session.clinician.organisation


def test_an_empty_list_says_so(desk: Desk) -> None:
    assert "No case here." in desk.get("/desk")


def test_what_waits_is_listed_and_what_is_decided_lies_elsewhere(desk: Desk, service: Service) -> None:
    case = in_review(service, organisation(desk), external_id="KH-117")
    page = desk.get("/desk")
    assert f"/desk/cases/{case}" in page
    assert "KH-117" in page
    assert "Waits for review" in page
    Hand(desk, case).press("back", reason="blurred")
    assert case not in desk.get("/desk")
    assert case in desk.get("/desk?show=decided")


def test_the_list_shows_no_picture_of_anybody(desk: Desk, service: Service) -> None:
    in_review(service, organisation(desk))
    main = desk.get("/desk").split("<main", 1)[1]
    assert "<img" not in main
    assert "<iframe" not in main


def test_a_case_is_found_by_the_portals_own_id_wherever_it_lies(desk: Desk, service: Service) -> None:
    case = in_review(service, organisation(desk), external_id="KH-<2026>")
    other = in_review(service, organisation(desk), external_id="XY-1")
    Hand(desk, case).press("back", reason="blurred")
    page = desk.get("/desk?q=kh-<2")
    assert case in page
    assert other not in page
    assert "KH-&lt;2026&gt;" in page
    assert "No case here." in desk.get("/desk?q=nothing-like-it")
    desk.get("/desk?show=elsewhere", 422)


def test_nobody_sees_the_list_of_another_organisation(desk: Desk, service: Service) -> None:
    case = in_review(service, organisation(desk))
    stranger = signed_in(service, "lead", "Elsewhere Clinic")
    assert case not in stranger.get("/desk?show=all")
    assert case not in stranger.get(f"/desk?q={case[:8]}")


def test_the_page_hears_that_the_list_changed(desk: Desk, service: Service) -> None:
    async def told() -> list[str]:
        heard: list[str] = []
        http = httpx.AsyncClient(base_url=service.settings.address, cookies=desk.http.cookies, timeout=60)
        async with http, http.stream("GET", "/desk/live") as stream:
            async for line in stream.aiter_lines():
                if line.startswith("data:"):
                    heard.append(json.loads(line.removeprefix("data:"))["version"])
                    if len(set(heard)) == 2:
                        return heard
                    if len(heard) == 1:
                        await asyncio.to_thread(in_review, service, organisation(desk))
        raise AssertionError("the stream ended")

    assert len(set(asyncio.run(told()))) == 2
