"""The picture of the pages in the README: four windows of a phone side by side, of a sample body.

    PYTHONPATH=backend:. python -m references.make.journey

drives the real service with Chromium and writes `references/demo/journey.webp`.
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence

from PIL import Image, ImageDraw
from playwright.sync_api import Locator, Page

from lubdub.settings import PROJECT_FOLDER
from tests.benchmark.journey import desk
from tests.journeys.steps import answer_health, answer_who, walk_with_sample

TARGET = PROJECT_FOLDER / "references" / "demo" / "journey.webp"
WIDTH, HEIGHT, GAP, CORNER = 320, 692, 24, 26
"""Pixels; the shape of the phone in the benchmark."""
DRAWN_MS = 8_000
"""After the canvas stands there, the body still takes a moment without a graphics card."""
QUALITY = 82
FRAME = (217, 211, 200)


def window(page: Page) -> Image.Image:
    """What the phone shows now."""
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def shots() -> list[Image.Image]:
    """The first page, choosing an app, the marked points, and the four places."""
    with desk() as opened, opened.window() as context:
        page = context.new_page()
        page.goto("/")
        taken = [window(page)]
        answer_who(page)
        answer_health(page)
        page.goto(re.sub("/scan$", "/guide", page.url))
        taken.append(window(page))
        points: list[Image.Image] = []

        def press(target: Locator) -> None:
            if page.url.endswith("/points") and not points:
                shown(page)
                points.append(window(page))
            target.click()

        walk_with_sample(page, press)
        shown(page)
        return [*taken, *points, window(page)]


def shown(page: Page) -> None:
    """Waits for the picture of the body, at the top of the page."""
    page.frame_locator("#view").locator("canvas").first.wait_for(timeout=60_000)
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_timeout(DRAWN_MS)


def beside(pictures: Sequence[Image.Image]) -> Image.Image:
    """Side by side, with round corners, on nothing."""
    sheet = Image.new("RGBA", (len(pictures) * (WIDTH + GAP) - GAP, HEIGHT))
    mask = Image.new("L", (WIDTH, HEIGHT))
    ImageDraw.Draw(mask).rounded_rectangle((0, 0, WIDTH - 1, HEIGHT - 1), CORNER, fill=255)
    for place, picture in enumerate(pictures):
        small = picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
        ImageDraw.Draw(small).rounded_rectangle((0, 0, WIDTH - 1, HEIGHT - 1), CORNER, outline=FRAME, width=2)
        sheet.paste(small, (place * (WIDTH + GAP), 0), mask)
    return sheet


def main() -> None:
    """Write the picture."""
    beside(shots()).save(TARGET, quality=QUALITY, method=6)


if __name__ == "__main__":
    main()
