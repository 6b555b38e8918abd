"""The real service with the real pipeline, and a real browser in front of it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from lubdub.settings import Settings
from tests.journeys.home import Home
from tests.journeys.windows import new_window
from tests.web.service import ROOT, Service, free_port

CHROMIUM_FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
AXE = ROOT / "frontend" / "node_modules" / "axe-core" / "axe.min.js"
DRAWN_MS = 60_000
"""A picture without a graphics card takes 10 to 15 seconds, and more on a busy machine."""

OpenPage = Callable[..., Page]


@pytest.fixture(scope="session")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("product")
    settings = Settings(
        data_dir=folder / "data", port=free_port(), requests_per_minute=100_000, webhooks_to_private=True
    )
    running = Service(settings, worker_module="lubdub.jobs.worker")
    try:
        running.start_web()
        running.start_worker()
        yield running
    finally:
        running.stop()


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """The real pages, with a worker that does what the scan's bytes say; its clinician has a name."""
    folder = tmp_path_factory.mktemp("quick")
    settings = Settings(
        data_dir=folder / "data", port=free_port(), requests_per_minute=100_000, clinic_name="Harbour Clinic"
    )
    running = Service(settings)
    try:
        running.start_web()
        running.start_worker()
        yield running
    finally:
        running.stop()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One browser for a file of journeys. Playwright's event loop runs as long as it does, and no other can."""
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=chromium, args=CHROMIUM_FLAGS)
        yield started
        started.close()


@pytest.fixture
def open_page(browser: Browser, product: Service) -> Iterator[OpenPage]:
    """A fresh browser window: `open_page("phone")`, `open_page("desk", java_script_enabled=False)`."""
    contexts: list[BrowserContext] = []

    def opened(size: str, **more: object) -> Page:
        context = new_window(browser, product.settings.address, size, **more)
        contexts.append(context)
        return context.new_page()

    yield opened
    for context in contexts:
        context.close()


@pytest.fixture
def home(product: Service, browser: Browser) -> Iterator[Home]:
    """A family whose way to the page in question is made without a browser."""
    made = Home(product, browser)
    yield made
    made.close()


@pytest.fixture(scope="session")
def child_scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clean scan of a made-up child, in metres, seen from above."""
    from tests.bodies import hide_side, rescale, torso_scan, turn, write_ply

    place = tmp_path_factory.mktemp("scans") / "child.ply"
    scan = turn(rescale(hide_side(torso_scan(size=0.62)), "m"), degrees=(5, 10, 0))
    place.write_bytes(write_ply(scan.surface))
    return place
