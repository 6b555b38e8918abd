"""A clinician marks a reference body in a real browser: by tap and by keys alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from lubdub.library.marks import read_marks
from lubdub.results import AREA_NAMES
from tests.journeys.clinic import Room
from tests.journeys.conftest import DRAWN_MS
from tests.journeys.steps import WORK_MS, middle_of_view, stands, wait_for_body
from tests.journeys.test_review import tab_to
from tests.web.service import Service

pytestmark = pytest.mark.browser

BODY = "man-25"


def folder_of(service: Service) -> Path:
    folder = service.settings.own_references
    assert folder is not None
    return folder


@pytest.fixture
def room(product: Service, browser: Browser) -> Iterator[Room]:
    made = Room(product, browser)
    yield made
    for context in made.contexts:
        context.close()
    for path in (folder_of(product) / "marks").glob("*/*.json"):
        path.unlink()


def test_a_body_is_marked_by_a_tap_and_by_keys_handed_in_and_withdrawn(room: Room, product: Service) -> None:
    page = room.window()
    page.goto("/desk/references")
    stands(page)
    page.locator(f"[data-body='{BODY}']").click()
    wait_for_body(page)
    stands(page)
    page.locator("#main-button").click()
    expect(page.locator("[data-area=aortic][aria-current]")).to_be_visible(timeout=DRAWN_MS)
    page.mouse.click(*middle_of_view(page, 0.5, 0.35))
    expect(page.locator("[data-area=aortic] .areas__state")).to_have_text("marked", timeout=DRAWN_MS)
    for area in AREA_NAMES[1:]:
        tab_to(page, f"[data-area={area}]")
        page.keyboard.press("Enter")
        expect(page.locator(f"[data-area={area}][aria-current]")).to_be_visible(timeout=DRAWN_MS)
        page.keyboard.press("Shift+ArrowRight")
        expect(page.locator(f"[data-area={area}] .areas__state")).to_have_text("marked", timeout=DRAWN_MS)
        expect(page.locator(f"[data-area={area}]")).to_be_focused()
    tab_to(page, "#main-button")
    expect(page.locator("#main-button")).to_have_text("Hand in")
    stands(page)
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("/desk/references$"), timeout=WORK_MS)
    (marks,) = read_marks(folder_of(product), BODY)
    assert marks.handed_in_at
    page.goto(f"/desk/references/{BODY}")
    stands(page)
    page.locator("#withdraw").click()
    page.wait_for_url(re.compile("/desk/references$"), timeout=WORK_MS)
    assert read_marks(folder_of(product), BODY) == []
