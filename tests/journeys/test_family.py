"""A family in front of a real browser, the real pipeline behind it."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from tests.journeys.conftest import DRAWN_MS, OpenPage
from tests.journeys.home import Home
from tests.journeys.steps import (
    WORK_MS,
    Watch,
    answer_health,
    answer_who,
    choose,
    confirm_size,
    expect_marked,
    leads_on,
    middle_of_view,
    place_on_page,
    reload_shows_the_same,
    send,
    stands,
    wait_for_body,
)

pytestmark = pytest.mark.browser


def test_a_sample_leads_to_four_places_on_a_phone(open_page: OpenPage) -> None:
    page = open_page("phone")
    watch = Watch(page)

    def is_good() -> None:
        stands(page)
        watch.is_silent()
        reload_shows_the_same(page)

    page.goto("/")
    stands(page)
    with leads_on(page):
        page.locator(".samples button").first.click()
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    is_good()
    confirm_size(page)
    is_good()
    with leads_on(page):
        page.get_by_role("button", name="Find the four places").first.click()
    page.wait_for_url(re.compile("/result$"), timeout=WORK_MS)
    is_good()
    for place in ("1. Aortic", "2. Pulmonary", "3. Tricuspid", "4. Mitral"):
        expect(page.get_by_role("heading", name=place)).to_be_visible()
    expect(page.get_by_text("This is not a diagnosis")).to_be_visible()
    picture = page.frame_locator("#view")
    expect(picture.locator("canvas").first).to_be_visible(timeout=DRAWN_MS)
    expect(picture.locator(".mantine-Paper-root:visible")).to_have_count(0)
    with leads_on(page):
        page.locator("main").get_by_role("link", name="Delete everything").click()
    is_good()
    with leads_on(page):
        page.get_by_role("button", name="Yes, delete everything").click()
    expect(page.get_by_role("heading", name="Everything is deleted")).to_be_visible()
    is_good()


def test_points_are_placed_on_the_body_by_tap_and_crosshair(open_page: OpenPage, child_scan: Path) -> None:
    page = open_page("desk")
    watch = Watch(page)
    answer_who(page)
    stands(page)
    answer_health(page)
    stands(page)
    send(page, child_scan)
    confirm_size(page)
    wait_for_body(page)
    before = place_on_page(page, "#frame")
    page.wait_for_timeout(2000)  # the camera is set once the view knows its window
    page.mouse.click(*middle_of_view(page, 0.5, 0.3))
    expect(page.locator("#ask-state")).to_contain_text("Marked", timeout=DRAWN_MS)
    page.get_by_role("button", name="It is right: next").click()
    expect(page.get_by_role("heading", name="Feel the lower end of the breastbone")).to_be_visible()
    page.get_by_role("button", name="Use a crosshair").click()
    page.get_by_role("button", name="Place here").click()
    expect(page.locator("#ask-state")).to_contain_text("Marked", timeout=DRAWN_MS)
    expect_marked(page, 2)
    assert place_on_page(page, "#frame") == before
    page.get_by_role("button", name="Undo").click()
    expect_marked(page, 1)
    page.mouse.move(*middle_of_view(page, 0.5, 0.6))
    page.wait_for_timeout(1500)  # what a pointer over the body would light up is drawn
    picture = np.asarray(Image.open(io.BytesIO(page.locator("#frame").screenshot())).convert("RGB"), float)
    assert ((picture[..., :2].min(axis=2) - picture[..., 2]) > 80).sum() == 0  # no yellow edge
    stands(page)
    watch.is_silent()


def test_nothing_covers_the_body_on_a_phone_and_a_tap_marks_it(home: Home, child_scan: Path) -> None:
    page = home.at_the_points(home.window(), child_scan)
    wait_for_body(page)
    covered = page.evaluate(
        """() => {
            const inside = document.getElementById("view").contentDocument;
            const { clientWidth: width, clientHeight: height } = inside.documentElement;
            const places = [];
            for (let x = 0.05; x < 1; x += 0.15) for (let y = 0.05; y < 1; y += 0.15) places.push([x, y]);
            return places.filter(([x, y]) => inside.elementFromPoint(x * width, y * height)?.tagName !== "CANVAS");
        }"""
    )
    assert covered == []
    page.wait_for_timeout(2000)  # the camera is set once the view knows its window
    page.touchscreen.tap(*middle_of_view(page, 0.5, 0.35))
    expect(page.locator("#ask-state")).to_contain_text("Marked", timeout=DRAWN_MS)


def test_a_file_that_is_no_body_ends_with_one_reason_and_one_fix(home: Home, tmp_path: Path) -> None:
    page = home.before_sending(home.window())
    letter = tmp_path / "letter.txt"
    letter.write_text("Dear grandmother,")
    send(page, letter)
    page.wait_for_url(re.compile("/refused$"), timeout=WORK_MS)
    stands(page)
    expect(page.locator("main").get_by_role("button", name="Send another scan")).to_be_visible()


def test_without_scripts_a_scan_is_sent_and_checked(home: Home, child_scan: Path) -> None:
    page = home.before_sending(home.window(java_script_enabled=False))
    send(page, child_scan)
    page.wait_for_url(re.compile("/(checking|size)$"))
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    expect(page.get_by_text("cm wide")).to_be_visible()


def test_mistakes_are_said_at_the_top_and_reached_by_keyboard(open_page: OpenPage) -> None:
    page = open_page("desk", color_scheme="dark")
    page.goto("/ask/who")
    choose(page, "My child")
    stands(page)
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the main part")).to_be_focused()
    page.get_by_role("button", name="Continue").focus()
    page.keyboard.press("Enter")
    expect(page.locator(".nhsuk-error-summary")).to_be_focused()
    stands(page)
    page.locator(".nhsuk-error-summary a").first.click()
    expect(page.get_by_label("Years")).to_be_focused()


def test_a_saved_picture_opens_without_a_network(open_page: OpenPage, tmp_path: Path) -> None:
    from lubdub.views.export import result_html
    from tests.views import sample

    file = tmp_path / "result.html"
    file.write_text(result_html(sample.outcome(), 6.0), encoding="utf-8")
    page = open_page("desk", offline=True)
    asked: list[str] = []
    sockets: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: sockets.append(socket.url))
    page.goto(file.as_uri())
    expect(page.locator("canvas").first).to_be_visible(timeout=DRAWN_MS)
    page.wait_for_timeout(3000)
    assert [url for url in asked if not url.startswith(("data:", "blob:", "file:"))] == []
    assert sockets == []
