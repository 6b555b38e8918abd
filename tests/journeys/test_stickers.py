"""A child with two printed stickers: the scan marks its own bones, and a mirrored one is stopped."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests import bodies
from tests.journeys.home import Home
from tests.journeys.steps import WORK_MS, confirm_size, send, stands
from tests.painted import PaintedScan, painted

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def worn() -> PaintedScan:
    return painted(0.62)


def file_of(scan: PaintedScan, folder: Path) -> Path:
    path = folder / "child.glb"
    path.write_bytes(bodies.write_textured_glb(scan.scan.surface, scan.colouring))
    return path


def test_with_stickers_both_bones_are_marked_before_the_first_tap(
    home: Home, worn: PaintedScan, tmp_path: Path
) -> None:
    page = home.before_sending(home.window())
    sending = page.url
    page.goto(sending.replace("/scan", "/ready"))
    expect(page.get_by_role("link", name="Sticker sheet for A4")).to_be_visible()
    stands(page)
    page.goto(sending)
    send(page, file_of(worn, tmp_path))
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)
    expect(page.get_by_text("this scan is not mirrored")).to_be_visible()
    confirm_size(page)
    expect(page.get_by_text("by sticker")).to_have_count(2)
    expect(page.get_by_text("Point 3 of 5")).to_be_visible()


def test_a_mirrored_scan_is_stopped_by_its_stickers(home: Home, worn: PaintedScan, tmp_path: Path) -> None:
    page = home.before_sending(home.window())
    send(page, file_of(worn.mirrored(), tmp_path))
    page.wait_for_url(re.compile("/refused$"), timeout=WORK_MS)
    expect(page.get_by_text("the stickers on it read backwards")).to_be_visible()
    expect(page.locator("main").get_by_role("button", name="Send another scan")).to_be_visible()
