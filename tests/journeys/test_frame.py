"""The way to the scan in a real browser: whatever happens to the browser, the answers stay and every page stands."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.journeys.conftest import OpenPage
from tests.journeys.steps import (
    WORK_MS,
    Watch,
    answer_health,
    answer_who,
    choose,
    go_on,
    keep_picture,
    leads_on,
    reload_shows_the_same,
    small_targets,
    stands,
    walk_with_sample,
)

pytestmark = pytest.mark.browser

REFLOWED = {"width": 320, "height": 640}
"""What is left of a desk's window at 400 %; at 200 % there is twice that."""

MOST_TAPS = 12


def on_every_page(page: Page, see: Callable[[], None]) -> None:
    """From the first page to where a scan is sent, looking at each page."""
    page.goto("/")
    see()
    with leads_on(page):
        page.get_by_role("button", name="None of these: start").click()
    see()
    choose(page, "My child")
    see()
    page.get_by_label("Years").fill("6")
    go_on(page)
    for answer in ("girl or woman", "No", "No", "Lying on the back"):
        see()
        choose(page, answer)
    see()
    page.get_by_label("I may decide for this child").check()
    go_on(page)
    see()
    choose(page, "Yes, that is OK")
    see()
    with leads_on(page):
        page.get_by_role("button", name="KIRI Engine").click()
    see()
    with leads_on(page):
        page.get_by_role("button", name="Next: get ready").click()
    see()
    with leads_on(page):
        page.get_by_role("button", name="The scan is made: continue").click()
    page.wait_for_url(re.compile("/scan$"))


def test_every_page_before_the_scan_stands_on_a_phone(open_page: OpenPage) -> None:
    page = open_page("phone")
    on_every_page(page, lambda: stands(page))
    for path in ("/not-now", "/nowhere"):
        page.goto(path)
        stands(page)


def test_every_page_still_fits_when_it_is_shown_at_400_per_cent(open_page: OpenPage) -> None:
    page = open_page("desk")
    page.set_viewport_size(REFLOWED)  # type: ignore[arg-type]

    def fits() -> None:
        page.wait_for_load_state()
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= REFLOWED["width"], f"{page.url}: {wide}"
        assert small_targets(page) == []
        keep_picture(page, "large")

    on_every_page(page, fits)


def test_a_reload_at_any_page_loses_nothing(open_page: OpenPage) -> None:
    page = open_page("phone")
    on_every_page(page, lambda: reload_shows_the_same(page))


def test_all_pages_before_the_scan_work_without_scripts(open_page: OpenPage) -> None:
    page = open_page("phone", java_script_enabled=False)
    seen: list[str] = []
    on_every_page(page, lambda: seen.append(page.locator("h1").inner_text()))
    assert all(one != other for one, other in pairwise(seen))
    expect(page.get_by_label("The file from your scanning app")).to_be_visible()


def test_nothing_is_asked_of_others_kept_by_the_browser_or_told_by_an_address(open_page: OpenPage) -> None:
    page = open_page("desk")
    on_every_page(page, Watch(page).is_silent)


def test_back_shows_the_answer_and_going_on_again_works(open_page: OpenPage) -> None:
    page = open_page("phone")
    answer_who(page)
    page.go_back()
    expect(page.get_by_label("girl or woman")).to_be_checked()
    with leads_on(page):
        page.get_by_role("link", name="Back").click()
    expect(page.get_by_label("Years")).to_have_value("6")
    page.get_by_label("Years").fill("7")
    go_on(page)
    expect(page.get_by_label("girl or woman")).to_be_checked()
    go_on(page)
    answer_health(page)
    page.go_back()
    page.go_back()
    page.go_back()
    page.reload()
    expect(page.locator("h1")).to_be_visible()
    page.goto("/")
    page.get_by_role("link", name="Your child").click()
    page.wait_for_url(re.compile("/scan$"))


def test_two_tabs_share_one_set_of_answers(open_page: OpenPage) -> None:
    first = open_page("phone")
    answer_who(first)
    second = first.context.new_page()
    second.goto("/")
    with leads_on(second):
        second.get_by_role("link", name="Your answers so far").click()
    expect(second.locator("#heart_on_right")).to_be_visible()
    choose(second, "No")
    choose(first, "No")
    choose(first, "No")
    second.reload()
    choose(second, "No")
    expect(second.get_by_label("Lying on the back")).to_be_visible()


def test_a_closed_tab_is_continued_and_one_may_start_anew(open_page: OpenPage) -> None:
    page = open_page("phone")
    answer_who(page)
    again = page.context.new_page()
    page.close()
    again.goto("/")
    stands(again)
    with leads_on(again):
        again.get_by_role("button", name="None of these signs: start anew").click()
    expect(again.get_by_label("My child")).not_to_be_checked()


def test_a_clear_yes_stops_kindly_and_can_be_taken_back(open_page: OpenPage) -> None:
    page = open_page("phone")
    answer_who(page)
    choose(page, "Yes")
    expect(page.get_by_role("heading", name="We stop here, to be safe")).to_be_visible()
    stands(page)
    with leads_on(page):
        page.get_by_role("button", name="I made a mistake: go back").click()
    choose(page, "No")
    expect(page.locator("#chest_operation_or_device")).to_be_visible()


def test_the_sample_is_walked_with_the_keyboard_alone_and_can_be_deleted(open_page: OpenPage) -> None:
    page = open_page("desk")
    assert walk_with_sample(page, lambda target: press_by_keyboard(page, target)) <= MOST_TAPS
    expect(page.get_by_text("This is a sample.", exact=True)).to_be_visible()
    press_by_keyboard(page, page.locator(".page-foot").get_by_role("link", name="Delete everything"))
    press_by_keyboard(page, page.get_by_role("button", name="Yes, delete everything"))
    expect(page.get_by_role("heading", name="Everything is deleted")).to_be_visible(timeout=WORK_MS)
    page.goto("/")
    expect(page.get_by_text("Go on where you were")).to_have_count(0)


def press_by_keyboard(page: Page, target: Locator) -> None:
    """Tab until it has the focus, then the key that presses it."""
    expect(target).to_be_visible()
    for _ in range(120):
        if target.evaluate("element => element === document.activeElement"):
            is_choice = target.evaluate("element => element.matches('input[type=radio], input[type=checkbox]')")
            return page.keyboard.press("Space" if is_choice else "Enter")
        page.keyboard.press("Tab")
    raise AssertionError(f"the keyboard does not reach {target}")
