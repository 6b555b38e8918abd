"""A clinician reviews real results in a real browser: by mouse, by keys alone, on a desk and on a tablet."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from lubdub.results import AREA_NAMES
from tests.journeys.clinic import Room, is_drawn_at, on_screen, reviewed_soon
from tests.journeys.conftest import DRAWN_MS
from tests.journeys.steps import WORK_MS, leads_on, soon, stands, wait_for_body
from tests.web.reviewing import ORGANISATION
from tests.web.service import Service

pytestmark = pytest.mark.browser

MOST_ACTIONS = 6


@pytest.fixture
def room(product: Service, browser: Browser) -> Iterator[Room]:
    made = Room(product, browser)
    yield made
    made.close()


def test_a_clean_case_is_signed_in_six_actions(room: Room, product: Service) -> None:
    case = reviewed_soon(product, "KH-100")
    page = room.window()
    page.goto("/desk")
    stands(page)
    actions = 0

    def press(selector: str) -> None:
        nonlocal actions
        page.locator(selector).click()
        actions += 1

    press(f"[data-case='{case}']")
    wait_for_body(page)
    stands(page)
    for area in AREA_NAMES:
        press("#main-button")
        expect(page.locator(f"[data-area={area}] .areas__state")).to_have_text("looked at", timeout=DRAWN_MS)
    press("#main-button")
    page.wait_for_url(re.compile("/desk$"), timeout=WORK_MS)
    assert product.portal(ORGANISATION).state(case)["status"] == "reviewed"
    assert actions <= MOST_ACTIONS
    page.goto(f"/desk/cases/{case}")
    expect(page.get_by_text("Signed: Dr Clinician")).to_be_visible()
    on_a_phone = room.window("phone")
    on_a_phone.goto(f"/desk/cases/{case}")
    picture, beside = (on_a_phone.locator(part).bounding_box() for part in ("#frame", "#panel"))
    assert picture is not None
    assert beside is not None
    assert picture["width"] > 340
    assert beside["width"] > 340
    assert beside["y"] > picture["y"] + picture["height"]
    stands(on_a_phone)


def test_an_area_is_dragged_seen_beside_where_it_was_and_put_back(room: Room, product: Service) -> None:
    case = reviewed_soon(product, "KH-200")
    page = room.window()
    page.goto(f"/desk/cases/{case}")
    wait_for_body(page)
    page.locator("[data-area=mitral]").click()
    expect(page.locator("[data-area=mitral][aria-current]")).to_be_visible(timeout=DRAWN_MS)
    x, y = on_screen(page, product, case, "mitral")
    soon(page, lambda: is_drawn_at(page, "mitral", x, y), "the mitral area's letter before the camera")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 15, y - 5, steps=5)
    page.mouse.move(x + 40, y - 10, steps=5)
    page.mouse.up()
    expect(page.locator("[data-area=mitral] .areas__state")).to_have_text(re.compile("moved"), timeout=DRAWN_MS)
    for button in ("Gap", "Fitted body", "As computed"):
        page.get_by_role("button", name=button).click()
        expect(page.get_by_role("button", name=button)).to_have_attribute("aria-pressed", "true")
        page.wait_for_timeout(1500)
        stands(page)
    page.locator("#undo").click()
    expect(page.locator("[data-area=mitral] .areas__state")).to_have_text("looked at", timeout=DRAWN_MS)


def tab_to(page: Page, selector: str, most: int = 60) -> None:
    """As somebody without a mouse."""
    for _ in range(most):
        page.keyboard.press("Tab")
        if page.evaluate("selector => document.activeElement?.matches(selector) ?? false", selector):
            return
    raise AssertionError(f"{selector} cannot be reached with the Tab key")


def test_everything_can_be_done_with_keys_alone(room: Room, product: Service) -> None:
    first, case = (reviewed_soon(product, number) for number in ("KH-300", "KH-301"))
    page = room.window("tablet")
    page.goto("/desk?q=KH-30")
    expect(page.locator(f"[data-case='{first}']")).to_be_focused()
    page.keyboard.press("j")
    expect(page.locator(f"[data-case='{case}']")).to_be_focused()
    page.keyboard.press("k")
    page.keyboard.press("j")
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile(case))
    wait_for_body(page)
    stands(page)
    tab_to(page, "[data-area=aortic]")
    page.keyboard.press("Enter")
    expect(page.locator("[data-area=aortic] .areas__state")).to_have_text("looked at", timeout=DRAWN_MS)
    page.keyboard.press("ArrowRight")
    expect(page.locator("[data-area=aortic] .areas__state")).to_have_text(re.compile("moved 2"), timeout=DRAWN_MS)
    page.keyboard.press("Shift+ArrowUp")
    expect(page.locator("[data-area=aortic] .areas__state")).to_have_text(re.compile("moved (9|10)"), timeout=DRAWN_MS)
    expect(page.locator("[data-area=aortic]")).to_be_focused()
    tab_to(page, "#main-button")
    for area in AREA_NAMES[1:]:
        page.keyboard.press("Enter")
        expect(page.locator(f"[data-area={area}] .areas__state")).to_have_text("looked at", timeout=DRAWN_MS)
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("/desk$"), timeout=WORK_MS)
    review = product.portal(ORGANISATION).call("GET", f"/cases/{case}/result", 200).json()["review"]
    assert set(review["areas"]) == {"aortic"}


def test_a_case_is_given_back_with_a_note_and_leaves_the_list_of_a_colleague(room: Room, product: Service) -> None:
    case = reviewed_soon(product, "KH-400")
    colleague, page = room.window("tablet"), room.window("tablet")
    colleague.goto("/desk?show=waiting&q=KH-400")
    expect(colleague.locator(f"[data-case='{case}']")).to_be_visible()
    page.goto(f"/desk/cases/{case}")
    page.get_by_text("Return to the family").click()
    page.get_by_label("Why").first.select_option("belly_missing")
    page.get_by_label("Note to the family").first.fill("Please include the navel.")
    stands(page)
    with leads_on(page):
        page.get_by_role("button", name="Return", exact=True).click()
    page.wait_for_url(re.compile("/desk$"), timeout=WORK_MS)
    expect(colleague.locator(f"[data-case='{case}']")).to_have_count(0, timeout=WORK_MS)
    assert product.portal(ORGANISATION).state(case)["reason"]["code"] == "belly_missing"
