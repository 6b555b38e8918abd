"""What a person does on the pages, step by step, and what every page must be."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from playwright.sync_api import Locator, Page, Request, Response, expect

from tests.journeys.conftest import AXE, DRAWN_MS

WORK_MS = 120_000


@contextmanager
def leads_on(page: Page) -> Iterator[None]:
    """What is done inside leads to another page, which has arrived whole when this ends.

    A click alone is over when the answer begins, a key even before it is asked for: whoever looks then sees the page
    that is left, or one without a body. And where a page answers at its own address, no address tells them apart.
    """
    with page.expect_navigation(timeout=WORK_MS):
        yield


def soon(page: Page, look: Callable[[], Any], what: str) -> Any:
    """The first true thing that look() sees, while the browser goes on drawing and answering."""
    deadline = time.monotonic() + WORK_MS / 1000
    while time.monotonic() < deadline:
        if seen := look():
            return seen
        page.wait_for_timeout(200)
    raise AssertionError(f"{page.url}: not in time: {what}")


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
    page.wait_for_load_state()
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), page.url
    assert small_targets(page) == [], f"{page.url}: too small for a thumb"
    schemes: tuple[Literal["dark", "light"], ...] = ("dark", "light")
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme)
        found = faults(page)
        assert not found, "\n".join([f"{page.url}, {scheme}", *found])
        keep_picture(page, scheme)


def small_targets(page: Page) -> list[str]:
    """What can be pressed and is less than 44 px high. Links inside a line of text may be as high as the line."""
    found: list[str] = page.evaluate(
        """() => [...document.querySelectorAll("a[href], button, summary, select, input:not([type=hidden])")]
            .filter(e => getComputedStyle(e).display !== "inline" && e.checkVisibility({visibilityProperty: true}))
            .filter(e => !e.matches(".nhsuk-skip-link"))
            .map(e => [e, (e.closest(".tile, .nhsuk-radios__item") ?? e).getBoundingClientRect()])
            .filter(([, box]) => box.height > 0 && box.height < 43.5)
            .map(([e, box]) => `${e.tagName} ${e.textContent.trim() || e.id} ${box.height}`)"""
    )
    return found


class Watch:
    """Listens to all that a window asks for, and says whether a page tells or keeps anything of a person."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self.strangers: list[str] = []
        self.kept: list[str] = []
        page.on("request", self._asked)
        page.on("response", self._answered)

    def _asked(self, request: Request) -> None:
        if not re.match(r"http://127\.0\.0\.1[:/]|data:|blob:", request.url):
            self.strangers.append(request.url)

    def _answered(self, response: Response) -> None:
        is_page = response.url.startswith("http") and "/static/" not in response.url
        if is_page and response.headers.get("cache-control") != "no-store":
            self.kept.append(response.url)

    def is_silent(self) -> None:
        """Nobody else was asked, nothing is kept, and neither title nor address says who it is about."""
        page = self._page
        assert page.evaluate("caches.keys()") == []
        assert page.evaluate("Object.keys(localStorage).length + Object.keys(sessionStorage).length") == 0
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+(/[a-z_0-9/-]*)?", page.url), page.url
        assert not re.search("[0-9]", page.title()), page.title()
        assert self.strangers == []
        assert self.kept == []


def reload_shows_the_same(page: Page) -> None:
    """A page loaded again is the page it was."""
    heading, address = page.locator("h1").inner_text(), page.url
    page.reload()
    assert (page.locator("h1").inner_text(), page.url) == (heading, address)


def keep_picture(page: Page, name: str) -> None:
    """A picture of the page for somebody to look at, in the folder that LUBDUB_TEST_PICTURES names."""
    folder = os.environ.get("LUBDUB_TEST_PICTURES")
    if folder:
        step = re.sub("[^a-z_-]+", "-", re.sub("^.*?//[^/]*|/cases/[0-9a-f]+", "", page.url)).strip("-") or "start"
        width = page.viewport_size["width"] if page.viewport_size else 0
        page.screenshot(path=Path(folder) / f"{step}-{width}-{name}.png", full_page=True)


def answer_who(page: Page, years: str = "6", sex: str = "girl or woman") -> None:
    """The questions about the person."""
    page.goto("/ask/who")
    choose(page, "My child")
    page.get_by_label("Years").fill(years)
    go_on(page)
    choose(page, sex)
    page.wait_for_selector("#heart_on_right")


def answer_health(page: Page) -> None:
    """No to everything, consent of both, and a file that is there already."""
    choose(page, "No")
    choose(page, "No")
    choose(page, "Lying on the back")
    page.get_by_label("I may decide for this child").check()
    go_on(page)
    choose(page, "Yes, that is OK")
    with leads_on(page):
        page.get_by_role("button", name="A file I already have").click()
    go_on(page)
    page.wait_for_url(re.compile("/scan$"))


def choose(page: Page, answer: str) -> None:
    """One answer, and on."""
    page.get_by_label(answer, exact=True).check()
    go_on(page)


def go_on(page: Page) -> None:
    """To the next page."""
    with leads_on(page):
        page.get_by_role("button", name="Continue").click()


def send(page: Page, scan: Path) -> None:
    """Choose the file and send it."""
    page.set_input_files("#scan", scan)
    page.get_by_role("button", name="Send the scan").click()


def confirm_size(page: Page) -> None:
    """Size and sides are right."""
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    page.get_by_label("Yes, about right").check()
    page.get_by_label("Yes, that is the left side").check()
    go_on(page)
    page.wait_for_url(re.compile("/(points|feel)$"))
    if page.url.endswith("/feel"):
        page.get_by_role("button", name="I have felt both").click()
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


def expect_marked(page: Page, count: int) -> None:
    """So many points are marked, as they look right or odd."""
    expect(page.locator(".points__state:is(.points__state--marked, .points__state--odd)")).to_have_count(
        count, timeout=DRAWN_MS
    )


def middle_of_view(page: Page, across: float = 0.5, down: float = 0.5) -> tuple[float, float]:
    """A place in the 3D view as page coordinates."""
    page.locator("#frame").scroll_into_view_if_needed()
    box = page.locator("#frame").bounding_box()
    assert box is not None
    return box["x"] + across * box["width"], box["y"] + down * box["height"]


def place_on_page(page: Page, selector: str) -> list[float]:
    """Where something lies and how large it is, wherever the page is scrolled to: left, top, width, height."""
    found: list[float] = page.locator(selector).evaluate(
        "e => [e.getBoundingClientRect()].flatMap(b => [b.x + scrollX, b.y + scrollY, b.width, b.height])"
    )
    return found


def walk_with_sample(page: Page, press: Callable[[Locator], None] = Locator.click) -> int:
    """From the first page to the result with a made-up body, by the button each page offers; how often was pressed."""
    pressed = 0

    def tap(target: Locator) -> None:
        nonlocal pressed
        press(target)
        pressed += 1

    page.goto("/")
    tap(page.locator("#sample button").first)
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    for answer in ("Yes, about right", "Yes, that is the left side"):
        tap(page.get_by_label(answer))
    tap(page.get_by_role("button", name="Continue"))
    page.wait_for_url(re.compile("/(feel|points)$"))
    if page.url.endswith("/feel"):
        tap(page.locator("main form .nhsuk-button").first)
        page.wait_for_url(re.compile("/points$"))
    heading, button = page.locator("#ask h1"), page.locator(".ask__buttons .nhsuk-button").first
    while "Find the four places" not in button.inner_text():
        asked = heading.inner_text()
        tap(button)
        expect(heading).not_to_have_text(asked)
    tap(button)
    page.wait_for_url(re.compile("/result$"), timeout=WORK_MS)
    return pressed
