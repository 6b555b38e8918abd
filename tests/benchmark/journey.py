"""`./lubdub benchmark journey`: what a family waits for, measured in a real browser at the real service.

Weights are bytes over the wire, headers and all, in the order of the way, styles and scripts kept as browsers keep
them. "Usable" is the later of the first words on the screen and the page's being ready to be pressed; the scripts
that come after it only ease what works without them. That is on a simulated slow 3G (400 kbit/s, 400 ms to the
server and back) and a processor four times slower. The result counts as visible when its heading stands on the
page, and as drawn when the picture of the body does. Taps are counted from the first page to the result with a
sample body, pressing what each page offers. Other work on the machine slows all of it: the last column of the last
table says how many processes wanted a core (the system's load).
"""

from __future__ import annotations

import functools
import os
import re
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

    from tests.web.service import Service

SLOW_3G = {"offline": False, "latency": 400, "downloadThroughput": 50_000, "uploadThroughput": 50_000}
"""Bytes a second and milliseconds, as WebPageTest defines its slow 3G."""
SLOWER_PROCESSOR = 4
SIZE = {"width": 390, "height": 844}
LIMITS = {"first page, kB": 150.0, "usable, s": 2.0, "result visible, s": 5.0, "taps with the sample": 12.0}
THROTTLED = ("/", "/ask/who")


@dataclass
class Desk:
    """A running service and a browser before it."""

    service: Service
    browser: Browser

    @contextmanager
    def window(self) -> Iterator[BrowserContext]:
        """A phone that has never been here."""
        context = self.browser.new_context(base_url=self.service.settings.address, viewport=SIZE, has_touch=True)
        try:
            yield context
        finally:
            context.close()


@contextmanager
def desk() -> Iterator[Desk]:
    """The service with its worker in a folder of its own, and Chromium."""
    import shutil

    from playwright.sync_api import sync_playwright

    from lubdub.settings import Settings
    from tests.journeys.conftest import CHROMIUM_FLAGS
    from tests.web.service import Service, free_port

    with tempfile.TemporaryDirectory(prefix="lubdub-journey-") as folder, sync_playwright() as playwright:
        settings = Settings(data_dir=Path(folder) / "data", port=free_port(), requests_per_minute=100_000)
        service = Service(settings, worker_module="lubdub.jobs.worker")
        chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
        try:
            service.start_web()
            service.start_worker()
            browser = playwright.chromium.launch(executable_path=chromium, args=CHROMIUM_FLAGS)
            yield Desk(service, browser)
            browser.close()
        finally:
            service.stop()


def one_family(turn: int) -> list[Row]:
    """All measurements of one turn, in a fresh service."""
    with desk() as opened:
        rows = [weighed(opened, path) | {"turn": turn} for path in THROTTLED]
        return [*rows, *({"turn": turn, **row} for row in walked(opened))]


def weighed(opened: Desk, path: str) -> Row:
    """One page, never seen before, on a slow network and processor."""
    with opened.window() as context:
        page = context.new_page()
        wire = context.new_cdp_session(page)
        wire.send("Network.enable")
        scale = Scale(wire)
        wire.send("Network.emulateNetworkConditions", SLOW_3G)
        wire.send("Emulation.setCPUThrottlingRate", {"rate": SLOWER_PROCESSOR})
        page.goto(path, wait_until="networkidle")
        shown, ready = page.evaluate(
            """() => [performance.getEntriesByName("first-contentful-paint")[0].startTime,
                      performance.getEntriesByType("navigation")[0].domContentLoadedEventEnd]"""
        )
        return {
            "what": "first visit",
            "page": path,
            "kB": scale.taken() / 1000,
            "shown_s": shown / 1000,
            "usable_s": max(shown, ready) / 1000,
        }


class Scale:
    """Adds up what comes over the wire."""

    def __init__(self, wire: Any) -> None:
        self._bytes = 0.0
        wire.on("Network.loadingFinished", self._add)

    def _add(self, event: dict[str, Any]) -> None:
        self._bytes += event["encodedDataLength"]

    def taken(self) -> float:
        """Bytes since the last time; the scale then stands at nothing."""
        taken, self._bytes = self._bytes, 0.0
        return taken


def walked(opened: Desk) -> list[Row]:
    """The sample's way: the weight of each page of it, the taps, and the wait after the last landmark."""
    from playwright.sync_api import Locator

    from tests.journeys.steps import walk_with_sample

    with opened.window() as context:
        page = context.new_page()
        wire = context.new_cdp_session(page)
        wire.send("Network.enable")
        scale, weights, pressed_at = Scale(wire), {}, 0.0

        def press(target: Locator) -> None:
            nonlocal pressed_at
            page.wait_for_load_state("networkidle")
            name = _step(page)
            weights[name] = weights.get(name, 0.0) + scale.taken()
            pressed_at = time.perf_counter()
            target.click()

        taps = walk_with_sample(page, press)
        page.get_by_role("heading", level=1).wait_for()
        visible = time.perf_counter() - pressed_at
        drawn = _drawn_after(page, pressed_at)
        weights["result"] = scale.taken()
        pages: list[Row] = [{"what": "on the way", "page": name, "kB": size / 1000} for name, size in weights.items()]
        load = os.getloadavg()[0]
        return [*pages, {"what": "sample", "taps": taps, "visible_s": visible, "drawn_s": drawn, "load": load}]


def _step(page: Page) -> str:
    return re.sub(r"^/cases/[0-9a-f]+/", "", page.url.removeprefix(page.evaluate("location.origin"))) or "/"


def _drawn_after(page: Page, since: float) -> float:
    page.frame_locator("#view").locator("canvas").first.wait_for(timeout=60_000)
    return time.perf_counter() - since


def _units(size: int, seed: int) -> Iterable[Unit]:
    for turn in range(size):
        yield Unit(f"turn {turn}", functools.partial(one_family, turn))


def report(rows: list[Row]) -> Report:
    """Medians over the turns beside what is promised."""
    first = _medians([row for row in rows if row["what"] == "first visit"], ("kB", "shown_s", "usable_s"))
    way = _medians([row for row in rows if row["what"] == "on the way"], ("kB",))
    sample = [row for row in rows if row["what"] == "sample"]
    found = {
        "first page, kB": first["/"]["kB"],
        "usable, s": max(numbers["usable_s"] for numbers in first.values()),
        "result visible, s": float(np.median([row["visible_s"] for row in sample])),
        "taps with the sample": float(max(row["taps"] for row in sample)),
    }
    kept: list[tuple[Cell, ...]] = [
        (name, found[name], limit, "yes" if found[name] <= limit else "no") for name, limit in LIMITS.items()
    ]
    drawn = float(np.median([row["drawn_s"] for row in sample]))
    tables = (
        Table("What is promised", ("what", "measured", "limit", "kept"), kept),
        Table(
            "First visit, slow 3G and a quarter of the processor",
            ("page", "kB", "shown_s", "usable_s"),
            [(page, *numbers.values()) for page, numbers in first.items()],
        ),
        Table("Weight on the sample's way", ("page", "kB"), [(page, numbers["kB"]) for page, numbers in way.items()]),
        Table(
            "After the last landmark, seconds",
            ("visible_s", "drawn_s", "processes at work on the machine"),
            [(found["result visible, s"], drawn, float(np.median([row["load"] for row in sample])))],
        ),
    )
    return Report(tables, {"found": found}, words=__doc__.split("\n", 2)[2] if __doc__ else "")


def _medians(rows: list[Row], columns: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Page -> column -> median over the turns, pages in the order of the way."""
    pages = dict.fromkeys(str(row["page"]) for row in rows)
    return {
        page: {name: float(np.median([row[name] for row in rows if row["page"] == page])) for name in columns}
        for page in pages
    }


JOURNEY = Experiment("journey", "what a family waits for, in a browser", 3, "how many turns", _units, report)
