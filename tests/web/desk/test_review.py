"""The review page and its live view, without a browser."""

from __future__ import annotations

import asyncio
import json
import re
from typing import Any

import httpx
import msgspec
import pytest
import websockets

from lubdub.results import AREA_NAMES
from tests.views import sample
from tests.web.reviewing import ORGANISATION, Hand, dial, in_review, vault_of, with_picture
from tests.web.service import Service
from tests.web.staff import Desk, signed_in


@pytest.fixture(scope="module")
def desk(service: Service) -> Desk:
    return signed_in(service, "clinician", ORGANISATION)


@pytest.fixture
def case(service: Service) -> str:
    return in_review(service)


def result_of(service: Service, case: str) -> dict[str, Any]:
    return dict(service.portal(ORGANISATION).call("GET", f"/cases/{case}/result", 200).json())


def moved_mm(page: str) -> float:
    """How far the first moved area lies from where it was computed, as the page says it."""
    found = re.search(r"moved ([0-9.]+)\xa0mm by Dr Clinician", page)
    assert found is not None
    return float(found.group(1))


def test_the_page_says_what_a_clinician_asks(desk: Desk, case: str) -> None:
    page = desk.get(f"/desk/cases/{case}")
    for words in ("Aortic", "Mitral", "14&nbsp;mm", "1.4\xa0mm", "4.0\xa0mm", "95%", "sample (100%)", "6 years old"):
        assert words in page, words
    assert page.count("to be looked at") == 4
    assert "Look at: Aortic" in page
    assert ">Sign<" not in page


def test_four_looks_in_the_picture_and_a_signature(desk: Desk, case: str, service: Service) -> None:
    hand = Hand(desk, case)
    hand.press("sign", 409)
    hand.look_at_all()
    assert ">Sign<" in desk.get(f"/desk/cases/{case}")
    assert hand.press("sign")["next"] == "/desk"
    result = result_of(service, case)
    assert (result["review"]["decision"], result["review"]["by"]) == ("signed", "Dr Clinician")
    assert "Signed: Dr Clinician" in desk.get(f"/desk/cases/{case}")


def test_an_area_counts_as_looked_at_only_in_a_picture(desk: Desk, case: str) -> None:
    said = Hand(desk, case).press("look", 503, area="aortic", window="0" * 8)
    assert "picture" in said["detail"]
    assert desk.get(f"/desk/cases/{case}").count("to be looked at") == 4


def test_keys_move_an_area_along_the_skin_and_undo_takes_it_back(desk: Desk, case: str) -> None:
    hand = Hand(desk, case)
    far = moved_mm(hand.press("move", area="mitral", left_mm="10", up_mm="0")["panel"])
    assert far == pytest.approx(10.0, abs=0.7)
    assert moved_mm(hand.press("move", area="mitral", left_mm="2", up_mm="-2")["panel"]) > far + 1.0
    hand.press("undo")
    assert moved_mm(desk.get(f"/desk/cases/{case}")) == far
    assert "by Dr Clinician" not in hand.press("undo")["panel"]
    hand.press("undo", 409)


def test_a_moved_landmark_asks_for_a_new_run_before_anything_is_signed(desk: Desk, case: str, service: Service) -> None:
    hand = Hand(desk, case)
    hand.look_at_all()
    panel = hand.press("move", landmark="xiphisternum", left_mm="0", up_mm="10")["panel"]
    assert "Run again with these points" in panel
    assert ">Sign<" not in panel
    hand.press("sign", 409)
    hand.press("run")
    service.portal(ORGANISATION).wait(case, "in_review")
    asked = json.loads(vault_of(service).read(case, "result.json"))["asked"]["landmarks"]
    before = sample.outcome().landmarks["xiphisternum"].position / 1000
    assert asked["xiphisternum"][1] - before[1] == pytest.approx(0.010, abs=0.001)


def test_an_area_cannot_be_sent_far_away_in_one_go(desk: Desk, case: str, service: Service) -> None:
    hand = Hand(desk, case)
    hand.press("move", area="aortic", left_mm="100000", up_mm="0")
    hand.press("move", 400, area="aortic", left_mm="nan", up_mm="0")
    hand.press("move", 400, area="nowhere", left_mm="1", up_mm="0")
    hand.look_at_all()
    hand.press("sign")
    assert result_of(service, case)["review"]["areas"]["aortic"]["moved_mm"] < 41


CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [0.0, 0.0, 1.0],
    "fov": 0.6,
    "near": 0.01,
    "far": 100.0,
    "image_height": 400,
    "image_width": 300,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 1.0, 0.0],
}
DRAG = {
    "type": "SceneNodeDragMessage",
    "name": "/areas/mitral/letter",
    "instance_index": None,
    "start_screen_pos": [0.5, 0.5],
    "end_screen_pos": [0.6, 0.5],
    "button": "left",
    "modifier": None,
    "owner": "",
}


async def drag_mitral(socket: Any) -> None:
    """One centimetre to the patient's left, in the plane of the screen."""
    start = (sample.outcome().areas["mitral"].position / 1000).tolist()
    end = [start[0] + 0.010, *start[1:]]
    await socket.send(msgspec.msgpack.encode(CAMERA))
    await asyncio.sleep(0.5)
    for phase, place in (("start", start), ("end", end)):
        said = {**DRAG, "phase": phase, "start_position": start, "end_position": place}
        await socket.send(msgspec.msgpack.encode(said))
        await asyncio.sleep(1.0)


def test_a_drag_in_the_picture_is_stored_as_the_clinicians(desk: Desk, case: str) -> None:
    with_picture(desk, case, lambda window, socket: drag_mitral(socket))
    assert moved_mm(desk.get(f"/desk/cases/{case}")) == pytest.approx(10.0, abs=2.5)


def test_in_a_case_that_is_decided_nothing_can_be_dragged(desk: Desk, case: str, service: Service) -> None:
    hand = Hand(desk, case)
    hand.look_at_all()
    hand.press("sign")
    with_picture(desk, case, lambda window, socket: drag_mitral(socket))
    assert result_of(service, case)["review"]["areas"] == {}


def test_two_who_review_at_once_are_told_and_nothing_is_lost(desk: Desk, case: str, service: Service) -> None:
    mine, theirs = Hand(desk, case), Hand(signed_in(service, "lead", ORGANISATION), case)
    mine.press("move", area="aortic", left_mm="4", up_mm="0")
    said = theirs.press("move", 409, area="aortic", left_mm="-4", up_mm="0")
    assert "Somebody else" in said["detail"]
    assert moved_mm(theirs.desk.get(f"/desk/cases/{case}")) == pytest.approx(4.0, abs=0.5)


def test_a_case_given_back_says_why_to_the_portal(desk: Desk, case: str, service: Service) -> None:
    hand = Hand(desk, case)
    hand.press("back", 400, reason="because")
    assert hand.press("back", reason="belly_missing", note="Please include the navel.")["next"] == "/desk"
    state = service.portal(ORGANISATION).state(case)
    assert (state["status"], state["reason"]["code"]) == ("returned", "belly_missing")
    assert "Returned" in desk.get(f"/desk/cases/{case}")


def test_another_organisation_finds_nothing_at_any_address(case: str, service: Service) -> None:
    stranger = signed_in(service, "administrator", "Elsewhere Clinic")
    for path in (f"/desk/cases/{case}", f"/desk/cases/{case}/panel", f"/desk/view/{case}/00/"):
        stranger.get(path, 404)
    stranger.get(f"/desk/cases/{case}/live", 404)
    Hand(stranger, case).press("look", 404, area="aortic", window="00")
    stranger.post(f"/desk/cases/{case}/look", 404, layer="skin")


def refused(desk: Desk, case: str, window: str, origin: str | None = None) -> int:
    async def attempt() -> None:
        async with dial(desk, case, window, origin):
            pass

    with pytest.raises(websockets.InvalidStatus) as error:
        asyncio.run(attempt())
    return int(error.value.response.status_code)


def test_the_views_socket_opens_for_its_own_clinician_and_our_own_pages_alone(
    desk: Desk, case: str, service: Service
) -> None:
    desk.get(f"/desk/view/{case}/0a/")
    assert refused(desk, case, "0a", origin="https://elsewhere.example") == 403
    assert refused(Desk(service), case, "0a") == 403
    assert refused(signed_in(service, "clinician", "Elsewhere Clinic"), case, "0a") == 403
    colleague = signed_in(service, "clinician", ORGANISATION)
    assert refused(colleague, case, "0a") == 403, "whose view was never opened"
    desk.get(f"/desk/view/{case}/0a/?websocket=wss://elsewhere.example", 400)


def test_what_a_view_may_not_be_told_is_swallowed(desk: Desk, case: str) -> None:
    async def still_open(window: str, socket: Any) -> bool:
        await socket.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        await socket.send(msgspec.msgpack.encode({"type": "SceneNodeClickMessage", "name": "/skin"}))
        pong = await socket.ping()
        await asyncio.wait_for(pong, 20)
        return socket.close_code is None

    assert with_picture(desk, case, still_open)


def test_the_page_hears_when_the_review_went_on(desk: Desk, case: str) -> None:
    hand = Hand(desk, case)

    async def told() -> list[int]:
        heard = []
        http = httpx.AsyncClient(base_url=desk.service.settings.address, cookies=desk.http.cookies, timeout=30)
        async with http, http.stream("GET", f"/desk/cases/{case}/live") as stream:
            async for line in stream.aiter_lines():
                if line.startswith("data:"):
                    heard.append(json.loads(line.removeprefix("data:"))["version"])
                    if len(heard) == 2:
                        return heard
                    await asyncio.to_thread(hand.press, "move", area="aortic", left_mm="2", up_mm="0")
        raise AssertionError("the stream ended")

    assert asyncio.run(told()) == [0, 1]


def test_reviewing_leaves_its_lines_in_the_audit_trail(desk: Desk, case: str, service: Service) -> None:
    from lubdub.cases.database import Database
    from lubdub.cases.models import AuditRow

    desk.get(f"/desk/cases/{case}")
    with Database(service.settings.database).reading() as session:
        lines = session.query(AuditRow).filter_by(case_id=case, action="review.read").all()
    assert [line.actor for line in lines] == [f"clinician:{desk.session.clinician.id}"]  # type: ignore[union-attr]


def test_every_area_is_there_to_be_looked_at(desk: Desk, case: str) -> None:
    page = desk.get(f"/desk/cases/{case}")
    assert [name for name in AREA_NAMES if f'data-area="{name}"' in page] == list(AREA_NAMES)
