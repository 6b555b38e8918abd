"""Marking the points in a real browser: fingers, pins, keys, a lost view, two windows, and pictures that cannot be."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import CDPSession, Locator, Page, expect
from scipy.ndimage import label

from tests.journeys.conftest import DRAWN_MS
from tests.journeys.home import Home
from tests.journeys.steps import (
    WORK_MS,
    expect_marked,
    leads_on,
    middle_of_view,
    send,
    soon,
    stands,
    wait_for_body,
)
from tests.web.service import Service

pytestmark = pytest.mark.browser


def test_the_two_bones_are_taught_first_on_a_page_that_stands(home: Home, child_scan: Path) -> None:
    page = home.before_sending(home.window())
    send(page, child_scan)
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    page.get_by_label("Yes, about right").check()
    page.get_by_label("Yes, that is the left side").check()
    with leads_on(page):
        page.get_by_role("button", name="Continue").click()
    expect(page.get_by_role("heading", name="First, feel two bones with a finger")).to_be_visible()
    page.get_by_text("Use stickers").click()
    expect(page.get_by_role("link", name="Sticker sheet for A4 paper")).to_be_visible()
    stands(page)
    page.get_by_role("button", name="I have felt both").click()
    page.wait_for_url(re.compile("/points$"))
    stands(page)
    expect(page.get_by_role("button", name="I cannot feel it")).to_be_in_viewport(ratio=1)
    page.set_viewport_size({"width": 320, "height": 640})  # a desk's window at 400 %
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    page.go_back()
    expect(page.get_by_role("heading", name="First, feel two bones with a finger")).to_be_visible()
    page.go_forward()
    page.reload()
    expect(page.get_by_role("heading", name="Feel the top of the breastbone")).to_be_visible()


def at_rest(page: Page) -> None:
    """The picture is drawn and its camera stands."""
    wait_for_body(page)
    page.wait_for_timeout(2000)  # the camera is set once the view knows its window


def pin(page: Page, colour: tuple[int, int, int], number: bool = False) -> tuple[float, float]:
    """Where a ball of about this colour comes to be drawn, as page coordinates; or the number above it."""
    drawn: tuple[float, float] = soon(page, lambda: pin_now(page, colour, number), "a pin")
    return drawn


def expect_pin_at(page: Page, colour: tuple[int, int, int], across: float, down: float | None = None) -> None:
    """The ball of this colour comes to be drawn there, to a few pixels."""

    def is_there() -> bool:
        drawn = pin_now(page, colour)
        return drawn is not None and abs(drawn[0] - across) < 9 and (down is None or abs(drawn[1] - down) < 9)

    soon(page, is_there, f"the pin at {across, down}")


def pin_now(page: Page, colour: tuple[int, int, int], number: bool = False) -> tuple[float, float] | None:
    """Where the picture as it is now has such a ball or number."""
    picture = np.asarray(Image.open(io.BytesIO(page.locator("#frame").screenshot())).convert("RGB"), float)
    blobs, count = label(np.linalg.norm(picture - colour, axis=2) < 40)
    blobs_of_size = [np.argwhere(blobs == n) for n in range(1, count + 1) if (blobs == n).sum() > 25]
    if not blobs_of_size:
        return None
    pick = min if number else max
    down, across = pick((blob.mean(axis=0) for blob in blobs_of_size), key=lambda middle: float(middle[0]))
    found = across / picture.shape[1], down / picture.shape[0]
    return middle_of_view(page, *found)


TEAL = (9, 100, 98)


def drag_by_mouse(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    for step in range(1, 11):
        page.mouse.move(*(a + (b - a) * step / 10 for a, b in zip(start, end, strict=True)))
        page.wait_for_timeout(50)  # viser reads the pointer once a frame
    page.mouse.up()


def drag_by_finger(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    fingers: CDPSession = page.context.new_cdp_session(page)

    def touch(kind: str, place: tuple[float, float] | None) -> None:
        points = [] if place is None else [{"x": place[0], "y": place[1]}]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", start)
    for step in range(1, 11):
        x, y = (a + (b - a) * step / 10 for a, b in zip(start, end, strict=True))
        touch("touchMove", (x, y))
        page.wait_for_timeout(50)  # viser reads the pointer once a frame
    touch("touchEnd", None)


@pytest.mark.parametrize("size", ["phone", "desk"])
def test_a_pin_is_dragged_to_its_place_and_nothing_else_moves(home: Home, child_scan: Path, size: str) -> None:
    page = home.at_the_points(home.window(size), child_scan)
    at_rest(page)
    press = page.touchscreen.tap if size == "phone" else page.mouse.click
    press(*middle_of_view(page, 0.5, 0.3))
    expect_marked(page, 1)
    before = page.locator("#frame").bounding_box()
    start = pin(page, TEAL)
    end = (start[0] + 25, start[1] + 30)
    held = pin(page, TEAL, number=True) if size == "phone" else start
    (drag_by_finger if size == "phone" else drag_by_mouse)(page, held, (held[0] + 25, held[1] + 30))
    expect_pin_at(page, TEAL, *end)
    assert page.locator("#frame").bounding_box() == before
    expect_marked(page, 1)


def test_a_point_is_placed_and_corrected_with_the_keyboard_alone(home: Home, child_scan: Path) -> None:
    page = home.at_the_points(home.window("desk"), child_scan)
    at_rest(page)
    toggle = page.get_by_role("button", name="Use a crosshair")
    press_until_focused(page, toggle)
    page.keyboard.press("Enter")
    place = page.get_by_role("button", name="Place here")
    expect(place).to_be_focused()
    for _ in range(6):
        page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    expect_marked(page, 1)
    # The crosshair stays in the middle; the pin leaves it as the body turns, and comes to it.
    middle, _ = middle_of_view(page)
    expect_pin_at(page, TEAL, middle)
    for _ in range(6):
        page.keyboard.press("ArrowLeft")
    soon(page, lambda: abs(pin(page, TEAL)[0] - middle) > 9, "the pin beside the crosshair")
    page.keyboard.press("Enter")
    expect_pin_at(page, TEAL, middle)
    press_until_focused(page, page.get_by_role("button", name="It is right: next"))
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Feel the lower end of the breastbone")).to_be_visible()
    stands(page)


def press_until_focused(page: Page, wanted: Locator) -> None:
    """Tab on until it has the focus."""
    for _ in range(40):
        if wanted.evaluate("element => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    raise AssertionError("Tab never comes there")


def test_a_view_cut_off_says_so_and_comes_back_with_the_points(home: Home, child_scan: Path) -> None:
    page = home.at_the_points(home.window("phone"), child_scan)
    at_rest(page)
    page.touchscreen.tap(*middle_of_view(page, 0.5, 0.3))
    expect_marked(page, 1)
    page.context.set_offline(True)
    expect(page.get_by_text("The picture lost its connection. Your points are safe.")).to_be_visible(timeout=DRAWN_MS)
    stands(page)
    page.context.set_offline(False)
    expect(page.locator("#frame-lost")).to_be_hidden(timeout=DRAWN_MS)
    at_rest(page)
    expect_marked(page, 1)
    page.get_by_role("button", name="It is right: next").click()
    expect(page.get_by_role("heading", name="Feel the lower end of the breastbone")).to_be_visible()
    page.touchscreen.tap(*middle_of_view(page, 0.5, 0.5))
    expect_marked(page, 2)


def test_a_server_started_again_finds_the_page_waiting_for_it(home: Home, child_scan: Path, product: Service) -> None:
    page = home.at_the_points(home.window("desk"), child_scan)
    at_rest(page)
    page.mouse.click(*middle_of_view(page, 0.5, 0.3))
    expect_marked(page, 1)
    web = next(process for process in product.processes if "run_web" in str(process.args))
    web.terminate()
    web.wait(30)
    expect(page.locator("#frame-lost")).to_be_visible(timeout=DRAWN_MS)
    product.start_web()
    expect(page.locator("#frame-lost")).to_be_hidden(timeout=DRAWN_MS)
    at_rest(page)
    expect_marked(page, 1)
    pin(page, TEAL)


def test_two_windows_of_one_case_follow_each_other(home: Home, child_scan: Path) -> None:
    page = home.at_the_points(home.window("desk"), child_scan)
    at_rest(page)
    second = page.context.new_page()
    second.goto(page.url)
    at_rest(second)
    second.mouse.click(*middle_of_view(second, 0.5, 0.3))
    expect_marked(second, 1)
    expect_marked(page, 1)
    page.get_by_role("button", name="Use a crosshair").click()
    page.get_by_role("button", name="Place here").click()
    expect(page.locator("#ask-state")).to_contain_text("two windows")
    second.close()
    page.reload()
    at_rest(page)
    expect_marked(page, 1)


def test_a_browser_that_cannot_draw_says_so_and_goes_on_with_the_guesses(home: Home, child_scan: Path) -> None:
    page = home.window()
    page.add_init_script(
        """const real = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
            return kind.startsWith("webgl") ? null : real.call(this, kind, ...more);
        };"""
    )
    home.at_the_points(page, child_scan)
    expect(page.get_by_text("cannot draw the body in 3D")).to_be_visible()
    expect(page.locator("#frame")).to_be_hidden()
    stands(page)
    page.get_by_role("button", name="Find the four places now").click()
    page.wait_for_url(re.compile("/result$"), timeout=WORK_MS)


def test_without_scripts_the_points_page_says_what_is_missing_and_goes_on(home: Home, child_scan: Path) -> None:
    page = home.at_the_points(home.window("phone", java_script_enabled=False), child_scan)
    expect(page.locator("noscript .frame__lost")).to_be_visible()
    expect(page.locator("noscript .frame__lost")).to_contain_text("The picture needs JavaScript")
    page.get_by_role("button", name="Find the four places now").click()
    page.wait_for_url(re.compile("/(waiting|result)$"), timeout=WORK_MS)


def test_a_tap_on_a_guess_itself_marks_the_point_there(home: Home, child_scan: Path) -> None:
    page = home.at_the_points(home.window("phone"), child_scan)
    at_rest(page)
    page.touchscreen.tap(*middle_of_view(page, 0.5, 0.157))
    expect_marked(page, 1)
