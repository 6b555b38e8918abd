"""What a person does on the pages, step by step, and what every page must be."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal

from playwright.sync_api import Page, expect

from tests.journeys.conftest import AXE, DRAWN_MS

WORK_MS = 120_000


def faults(page: Page) -> list[str]:
    """What axe-core finds against WCAG 2.2 AA on the page as it is now; the 3D view's inside is viser's own."""
    page.evaluate(AXE.read_text(encoding="utf-8"))
    options = {"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"], "iframes": False}
    found: list[dict[str, Any]] = page.evaluate(
        "options => axe.run(document, options).then(r => r.violations)", options
    )
    return [f"{one['id']}: {node['target']} {node['failureSummary']}" for one in found for node in one["nodes"]]


def stands(page: Page) -> None:
    """Nothing sticks out sideways, a thumb can press everything, and axe-core has no complaint by day or night."""
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), page.url
    small = page.evaluate(
        """() => [...document.querySelectorAll("main button, main .nhsuk-button, main input[type=file], main .back")]
            .map(e => [e.textContent.trim(), e.getBoundingClientRect()])
            .filter(([_, box]) => box.height > 0 && box.height < 43.5).map(([words]) => words)"""
    )
    assert not small, f"{page.url}: too small for a thumb: {small}"
    schemes: tuple[Literal["dark", "light"], ...] = ("dark", "light")
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme)
        found = faults(page)
        assert not found, "\n".join([f"{page.url}, {scheme}", *found])


def answer_who(page: Page, years: str = "6", sex: str = "girl or woman") -> None:
    """The first questions."""
    page.goto("/who")
    page.get_by_label("Years").fill(years)
    page.get_by_label(sex).check()
    page.get_by_role("button", name="Continue").click()
    page.wait_for_selector("#heart_on_right")


def answer_health(page: Page) -> None:
    """No to everything."""
    for question in ("heart_on_right", "chest_operation_or_device"):
        page.locator(f"input[name={question}][value=no]").check()
    page.get_by_role("button", name="Continue").click()
    page.wait_for_url(re.compile("/scan$"))


def send(page: Page, scan: Path) -> None:
    """Choose the file and send it."""
    page.set_input_files("#scan", scan)
    page.get_by_role("button", name="Send the scan").click()


def confirm_size(page: Page) -> None:
    """Size and sides are right."""
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    page.get_by_label("Yes, about right").check()
    page.get_by_label("Yes, that is the left side").check()
    page.get_by_role("button", name="Continue").click()
    page.wait_for_url(re.compile("/points$"))


def wait_for_body(page: Page) -> None:
    """Until the live view shows something that is not paper."""
    frame = page.frame_locator("#view")
    expect(frame.locator("canvas").first).to_be_visible(timeout=DRAWN_MS)
    box = page.locator("#frame").bounding_box()
    assert box is not None
    page.wait_for_function(
        """async () => {
            const canvas = document.getElementById("view").contentDocument.querySelector("canvas");
            if (!canvas || canvas.width < 50) return false;
            const small = document.createElement("canvas");
            small.width = small.height = 8;
            const draw = small.getContext("2d");
            draw.drawImage(canvas, 0, 0, 8, 8);
            return draw.getImageData(4, 4, 1, 1).data[3] > 200;
        }""",
        timeout=DRAWN_MS,
        polling=500,
    )


def middle_of_view(page: Page, across: float = 0.5, down: float = 0.5) -> tuple[float, float]:
    """A place in the 3D view as page coordinates."""
    page.locator("#frame").scroll_into_view_if_needed()
    box = page.locator("#frame").bounding_box()
    assert box is not None
    return box["x"] + across * box["width"], box["y"] + down * box["height"]
