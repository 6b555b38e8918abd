"""Sending a scan from a real browser: over a broken network, across a reload, stopped, dropped, and the wrong file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from tests.journeys.home import Home
from tests.journeys.steps import WORK_MS, stands

pytestmark = pytest.mark.browser

PIECES = re.compile("/api/v1/uploads/")
ARRIVED = re.compile("/(checking|size|refused)$")


@pytest.fixture
def large_scan(child_scan: Path, tmp_path: Path) -> Path:
    """Three pieces long."""
    file = tmp_path / "large.ply"
    file.write_bytes(child_scan.read_bytes() + bytes(9_000_000))
    return file


def press_send(page: Page) -> None:
    page.locator("#send").click()


def kept_in_browser(page: Page) -> list[str]:
    found: list[str] = page.evaluate("Object.keys(localStorage)")
    return found


def test_a_lost_network_is_waited_out_and_the_scan_arrives(home: Home, large_scan: Path) -> None:
    page = home.before_sending(home.window("phone"))
    cut = {"done": False}

    def after_the_first_piece(route: Route) -> None:
        is_second = route.request.method == "PATCH" and route.request.headers["upload-offset"] != "0"
        if is_second and not cut["done"]:
            cut["done"] = True
            page.context.set_offline(True)
            route.abort("internetdisconnected")
        else:
            route.continue_()

    page.route(PIECES, after_the_first_piece)
    page.locator("#scan").set_input_files(large_scan)
    press_send(page)
    expect(page.get_by_text("Waiting for the network. Nothing is lost")).to_be_visible()
    stands(page)
    page.context.set_offline(False)
    page.wait_for_url(ARRIVED, timeout=WORK_MS)
    assert cut["done"]
    assert kept_in_browser(page) == []


def test_after_a_reload_the_same_file_goes_on_where_it_stopped(home: Home, large_scan: Path) -> None:
    page = home.before_sending(home.window("phone"))
    page.route(
        PIECES,
        lambda route: (
            route.continue_()
            if route.request.headers.get("upload-offset", "0") == "0"
            else route.abort("connectionreset")
        ),
    )
    page.locator("#scan").set_input_files(large_scan)
    with page.expect_response(lambda answer: answer.request.method == "PATCH"):
        press_send(page)
    expect(page.locator("#sent-words")).to_contain_text("Waiting for the network")
    assert large_scan.name not in str(page.evaluate("JSON.stringify(localStorage)"))
    page.reload()
    expect(page.get_by_text("Part of your scan is here already")).to_be_visible()
    page.unroute(PIECES)  # not before: the page that waits for the network would have sent the rest
    stands(page)
    begins: list[str] = []
    page.on(
        "request",
        lambda request: begins.append(request.headers["upload-offset"]) if request.method == "PATCH" else None,
    )
    page.locator("#scan").set_input_files(large_scan)
    press_send(page)
    page.wait_for_url(ARRIVED, timeout=WORK_MS)
    assert int(begins[0]) >= 4_000_000
    assert kept_in_browser(page) == []


def test_sending_can_be_stopped_and_nothing_of_it_stays(home: Home, large_scan: Path) -> None:
    page = home.before_sending(home.window("desk"))
    page.route(
        PIECES,
        lambda route: route.abort("connectionreset") if route.request.method == "PATCH" else route.continue_(),
    )
    page.locator("#scan").set_input_files(large_scan)
    press_send(page)
    expect(page.locator("#sent-words")).to_contain_text("Waiting for the network")
    with page.expect_response(lambda answer: answer.request.method == "DELETE") as removed:
        page.get_by_role("button", name="Stop sending").click()
    assert removed.value.status == 204
    expect(page.locator("#send")).to_be_visible()
    expect(page.locator("#scan")).to_be_focused()
    assert kept_in_browser(page) == []


def test_a_dropped_file_is_taken_like_a_chosen_one(home: Home, child_scan: Path) -> None:
    page = home.before_sending(home.window("desk"))
    dropped = page.evaluate_handle(
        """content => {
            const carried = new DataTransfer();
            carried.items.add(new File([new Uint8Array(content)], "child.ply"));
            return carried;
        }""",
        list(child_scan.read_bytes()),
    )
    page.dispatch_event("#drop", "drop", {"dataTransfer": dropped})
    press_send(page)
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)


WRONG = {
    b"\xff\xd8\xff\xe0\0\x10JFIF": "This is a picture",
    b"\0\0\0\x18ftypheic": "This is a picture",
    b"\0\0\0\x18ftypqt  ": "This is a video",
    b"%PDF-1.7": "This is a PDF document",
    b"": "This file is empty",
}


def test_a_wrong_file_is_told_before_it_is_sent(home: Home, tmp_path: Path) -> None:
    page = home.before_sending(home.window("phone"))
    sent: list[str] = []
    page.on("request", lambda request: sent.append(request.url) if "/api/v1/uploads" in request.url else None)
    for number, (beginning, told) in enumerate(WRONG.items()):
        file = tmp_path / f"chest-{number}.ply"
        file.write_bytes(beginning)
        page.locator("#scan").set_input_files(file)
        expect(page.locator("#send-problem")).to_contain_text(told)
        press_send(page)
        expect(page.locator("#send-problem")).to_contain_text(told)
    stands(page)
    assert sent == []


def test_a_file_of_two_gigabytes_is_told_before_it_is_sent(home: Home, tmp_path: Path) -> None:
    page = home.before_sending(home.window("phone"))
    file = tmp_path / "chest.glb"
    with file.open("wb") as made:
        made.truncate(2_000_000_000)
    page.locator("#scan").set_input_files(file)
    expect(page.locator("#send-problem")).to_contain_text("This file is larger than 300 MB.")
    expect(page.locator("#send-problem")).to_contain_text("cut it down to the chest")
