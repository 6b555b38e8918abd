"""A clinician reviews real results in a real browser: by mouse, by keys alone, on a desk and on a tablet."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, expect

from lubdub.report.archive import outcome_from_bytes
from lubdub.results import AREA_NAMES, AreaName
from lubdub.views.framing import FIELD_OF_VIEW, close_to, framed
from lubdub.views.stickers import AREA_STYLES
from tests.journeys.conftest import DRAWN_MS, SIZES
from tests.journeys.steps import WORK_MS, leads_on, middle_of_view, soon, stands, wait_for_body
from tests.web.desk import Desk, signed_in
from tests.web.reviewing import ORGANISATION, vault_of
from tests.web.service import ROOT, Service

pytestmark = pytest.mark.browser

DEMO = ROOT / "references" / "demo" / "phone-child"
MOST_ACTIONS = 6


@pytest.fixture(scope="module")
def scan() -> bytes:
    return (DEMO / "phone-child.glb").read_bytes()


def reviewed_soon(service: Service, scan: bytes, number: str) -> str:
    """A real result, sent to the clinicians."""
    portal = service.portal(ORGANISATION)
    patient = json.loads(Path(DEMO / "patient.json").read_text())
    case = portal.open_case(external_id=number, patient={"posture": "supine", **patient})
    portal.send(case, scan)
    portal.wait(case, "awaiting_landmarks")
    portal.call("PUT", f"/cases/{case}/landmarks", 202, json=json.loads((DEMO / "landmarks.json").read_text()))
    portal.wait(case, "done")
    portal.call("POST", f"/cases/{case}/review", 200)
    return case


class Room:
    """A clinician's windows."""

    def __init__(self, service: Service, browser: Browser) -> None:
        self.desk: Desk = signed_in(service, "clinician", ORGANISATION)
        self._browser = browser
        self.contexts: list[BrowserContext] = []

    def window(self, size: str = "desk") -> Page:
        width, height = SIZES[size]
        base = self.desk.service.settings.address
        context = self._browser.new_context(base_url=base, viewport={"width": width, "height": height})
        context.add_cookies(
            [{"name": one.name, "value": one.value or "", "url": base} for one in self.desk.http.cookies.jar]
        )
        self.contexts.append(context)
        return context.new_page()


@pytest.fixture
def room(product: Service, browser: Browser) -> Iterator[Room]:
    made = Room(product, browser)
    yield made
    for context in made.contexts:
        context.close()


def state_of(page: Page, area: AreaName) -> str:
    return page.locator(f"[data-area={area}] .areas__state").inner_text()


def on_screen(page: Page, service: Service, case: str, area: AreaName) -> tuple[float, float]:
    """Where an area's letter is drawn after it was chosen, as page coordinates."""
    outcome = outcome_from_bytes(vault_of(service).read(case, "outcome.npz"))
    assert outcome.scan is not None
    box = page.locator("#frame").bounding_box()
    assert box is not None
    aspect = box["width"] / box["height"]
    camera = close_to(outcome.areas[area], framed(outcome.scan, outcome.landmarks, aspect))
    forward = camera.look_at - camera.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    seen = outcome.areas[area].position - camera.position
    half = np.tan(FIELD_OF_VIEW / 2) * (seen @ forward)
    across, up = seen @ right / (half * aspect), seen @ np.cross(right, forward) / half
    return middle_of_view(page, 0.5 + across / 2, 0.5 - up / 2)


def is_drawn_at(page: Page, area: AreaName, x: float, y: float) -> bool:
    """Whether the area's own colour surrounds this place of the page: its camera has arrived."""
    shot = page.screenshot(clip={"x": x - 12, "y": y - 12, "width": 24, "height": 24})
    picture = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), float)
    return bool((np.linalg.norm(picture - AREA_STYLES[area].colour, axis=2) < 40).mean() > 0.2)


def test_a_clean_case_is_signed_in_six_actions(room: Room, product: Service, scan: bytes) -> None:
    case = reviewed_soon(product, scan, "KH-100")
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


def test_an_area_is_dragged_seen_beside_where_it_was_and_put_back(room: Room, product: Service, scan: bytes) -> None:
    case = reviewed_soon(product, scan, "KH-200")
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


def test_everything_can_be_done_with_keys_alone(room: Room, product: Service, scan: bytes) -> None:
    first, case = (reviewed_soon(product, scan, number) for number in ("KH-300", "KH-301"))
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


def test_a_case_is_given_back_with_a_note_and_leaves_the_list_of_a_colleague(
    room: Room, product: Service, scan: bytes
) -> None:
    case = reviewed_soon(product, scan, "KH-400")
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
