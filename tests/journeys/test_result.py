"""The result in front of a real browser: stepping, speaking, printing, keeping, and going on without a network."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from PIL import Image
from playwright.sync_api import Browser, Frame, Page, expect

from lubdub.results import AREA_NAMES, Reason
from lubdub.views.stickers import AREA_STYLES
from tests.journeys.conftest import DRAWN_MS
from tests.journeys.home import Home
from tests.journeys.steps import WORK_MS, leads_on, soon, stands
from tests.views import sample
from tests.web.service import Service

pytestmark = pytest.mark.browser

RECORD_SPEECH = """
    window.spoken = [];
    speechSynthesis.speak = (voice) => spoken.push([voice.lang, voice.text]);
    speechSynthesis.cancel = () => spoken.push("stop");
"""
"""Nobody can hear a test: what is asked of the browser's own voice is written down instead."""


@pytest.fixture
def home(quick: Service, browser: Browser) -> Iterator[Home]:
    made = Home(quick, browser)
    yield made
    made.close()


def turned_to(page: Page, place: str) -> Frame:
    """The picture's frame, once it shows this place."""
    page.locator(f"#view[data-place={place}]").wait_for(timeout=DRAWN_MS)
    return page.frames[1]


def eye(frame: Frame) -> list[float]:
    """Where the picture is seen from."""
    return [float(value) for value in str(frame.evaluate("document.documentElement.dataset.eye")).split()]


def expect_drawn(page: Page, areas: Iterable[str]) -> None:
    """These areas' badges, and no others, come to be seen in the picture."""
    wanted = set(areas)
    soon(page, lambda: marks_drawn(page) == wanted, f"the marks of {sorted(wanted)}")


def marks_drawn(page: Page) -> set[str]:
    """The areas whose badge is to be seen in the picture, by its colour."""
    picture = np.asarray(Image.open(io.BytesIO(page.locator("#frame").screenshot())).convert("RGB"), float)
    near = {name: np.linalg.norm(picture - style.colour, axis=2) < 30 for name, style in AREA_STYLES.items()}
    return {name for name, pixels in near.items() if pixels.sum() > 12}


def test_one_place_after_the_other_and_the_picture_turns_to_each(home: Home) -> None:
    page = home.result()
    seen = [eye(turned_to(page, "all"))]
    stands(page)
    expect_drawn(page, AREA_NAMES)
    for number, place in enumerate(AREA_NAMES, start=1):
        page.locator("#step-next").click()
        expect(page.locator("#step-now")).to_have_text(re.compile(f"^Place {number} of 4: {place.capitalize()}$"))
        expect(page.locator(".place:visible")).to_have_count(1)
        expect(page.locator(f".place[data-place={place}]")).to_have_attribute("aria-current", "step")
        seen.append(eye(turned_to(page, place)))
        expect_drawn(page, [place])
    assert len({tuple(one) for one in seen}) == 5
    stands(page)
    page.get_by_role("button", name="See all four").click()
    expect(page.locator(".place:visible")).to_have_count(4)
    assert eye(turned_to(page, "all")) == pytest.approx(seen[0], abs=1e-3)
    expect_drawn(page, AREA_NAMES)


def test_the_picture_jumps_where_motion_is_not_wanted(home: Home) -> None:
    def moves(motion: str) -> int:
        page = home.result("desk", reduced_motion=motion)
        frame = turned_to(page, "all")
        frame.evaluate(
            """() => {
                window.moves = 0;
                const watch = new MutationObserver(() => moves++);
                watch.observe(document.documentElement, { attributeFilter: ["data-eye"] });
            }"""
        )
        page.locator("#step-next").click()
        return int(turned_to(page, "aortic").evaluate("window.moves"))

    assert moves("reduce") == 1
    assert moves("no-preference") > 1


def test_the_steps_are_walked_with_the_keyboard_alone(home: Home) -> None:
    page = home.result("desk")
    turned_to(page, "all")
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "step-next":
            break
    expect(page.locator("#step-next")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.locator("#step-now")).to_contain_text("Place 1 of 4")
    page.keyboard.press("ArrowRight")
    expect(page.locator("#step-now")).to_contain_text("Place 2 of 4")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    expect(page.locator("#step-now")).to_contain_text("All four places")
    page.keyboard.press("ArrowLeft")
    expect(page.locator("#step-now")).to_contain_text("All four places")
    expect(page.locator("#step-next")).to_be_focused()


def test_the_browsers_own_voice_reads_what_is_shown_and_stops(home: Home) -> None:
    page = home.window()
    page.add_init_script(RECORD_SPEECH)
    page.goto(f"/cases/{home.family.done()}/result")
    page.locator("#step-next").click()
    page.get_by_role("button", name="Read it aloud").click()
    said = page.locator(".place:visible .place__where").inner_text()
    language, text = page.evaluate("spoken.at(-1)")
    assert language == "en"
    assert said in text
    assert "Aortic" in text
    assert "Pulmonary" not in text
    page.get_by_role("button", name="Stop reading").click()
    assert page.evaluate("spoken.at(-1)") == "stop"
    page.get_by_role("button", name="Read it aloud").click()
    page.locator("#step-next").click()
    assert page.evaluate("spoken.at(-1)") == "stop"
    expect(page.locator("#say")).to_have_attribute("aria-pressed", "false")


def test_a_browser_without_a_voice_offers_none(home: Home) -> None:
    page = home.window()
    page.add_init_script("delete window.speechSynthesis")
    page.goto(f"/cases/{home.family.done()}/result")
    expect(page.locator("#step-next")).to_be_visible()
    expect(page.locator("#say")).to_be_hidden()


def test_a_loaded_result_goes_on_without_a_network_and_nothing_is_kept(home: Home) -> None:
    page = home.result()
    turned_to(page, "all")
    page.context.set_offline(True)
    expect(page.get_by_text("You are offline.")).to_be_visible()
    page.locator("#step-next").click()
    turned_to(page, "aortic")
    page.context.set_offline(False)
    expect(page.get_by_text("You are offline.")).to_be_hidden()
    kept = "caches.keys().then(async names => [names, (await navigator.serviceWorker.getRegistrations()).length])"
    assert page.evaluate(kept) == [[], 0]
    assert page.evaluate("[localStorage.length, sessionStorage.length]") == [0, 0]


def test_the_kept_file_works_without_a_network_or_a_server(home: Home, tmp_path: Path) -> None:
    case = home.family.done()
    file = tmp_path / "lubdub-places.html"
    file.write_text(home.family.http.get(f"/api/v1/cases/{case}/view.html").text, encoding="utf-8")
    page = home.window("phone", offline=True)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(file.as_uri())
    turned_to(page, "all")
    page.locator("#step-next").click()
    turned_to(page, "aortic")
    expect(page.locator(".place:visible .place__where")).to_contain_text("to your child's right")
    stands(page)
    assert [url for url in asked if not url.startswith(("data:", "blob:", "file:", "about:"))] == []


def test_the_page_prints_on_one_sheet_with_all_four_places(home: Home) -> None:
    page = home.result("desk")
    turned_to(page, "all")
    page.locator("#step-next").click()
    turned_to(page, "aortic")
    for paper in ("A4", "Letter"):
        printed = pypdfium2.PdfDocument(page.pdf(format=paper))
        assert len(printed) == 1
        text = printed[0].get_textpage().get_text_range()
        for words in ("1. Aortic", "2. Pulmonary", "3. Tricuspid", "4. Mitral", "not a diagnosis", "How to listen"):
            assert words in text


def test_a_result_with_care_and_a_sent_page_stand(home: Home) -> None:
    reason = Reason("bones_not_given", "The breastbone was not marked.", "Feel for it and mark it.")
    case = home.family.done(replace(sample.outcome(), verdict="show_with_care", reasons=(reason,)))
    page = home.window()
    page.goto(f"/cases/{case}/result")
    expect(page.get_by_text("The breastbone was not marked.")).to_be_visible()
    stands(page)
    with leads_on(page):
        page.get_by_role("button", name="Send to Harbour Clinic").click()
    expect(page.get_by_text("Sent to Harbour Clinic.")).to_be_visible()
    stands(page)
    page.set_viewport_size({"width": 320, "height": 640})  # a desk's window at 400 %
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    with leads_on(page):
        page.get_by_role("button", name="Take it back").click()
    expect(page.get_by_role("button", name="Send to Harbour Clinic")).to_be_visible()


def test_without_scripts_all_places_are_a_plain_list(home: Home) -> None:
    page = home.result(java_script_enabled=False)
    expect(page.locator(".place:visible")).to_have_count(4)
    expect(page.locator("#stepper")).to_be_hidden()


def test_waiting_goes_on_by_asking_when_the_stream_is_broken(home: Home) -> None:
    case = home.family.opened()
    home.family.send(case, b"slow 4")
    page = home.window()
    page.route("**/events", lambda route: route.abort())
    page.goto(f"/cases/{case}/checking")
    expect(page.get_by_text("Finding the chest in the scan").or_(page.locator("#stage"))).to_be_visible()
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)


def test_waiting_says_when_the_service_is_out_of_reach_and_goes_on_afterwards(home: Home) -> None:
    case = home.family.opened()
    home.family.send(case, b"slow 8")
    page = home.window()
    page.goto(f"/cases/{case}/checking")
    page.context.set_offline(True)
    expect(page.get_by_text("We cannot reach the service right now.")).to_be_visible(timeout=WORK_MS)
    page.context.set_offline(False)
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)


def test_waiting_without_scripts_loads_itself_again(home: Home) -> None:
    case = home.family.opened()
    home.family.send(case, b"slow 3")
    page = home.window(java_script_enabled=False)
    page.goto(f"/cases/{case}/checking")
    page.wait_for_url(re.compile("/size$"), timeout=WORK_MS)


def test_the_waiting_page_stands_and_stopping_goes_back_to_the_scan(home: Home) -> None:
    case = home.family.opened()
    home.family.send(case, b"slow 60")
    page = home.window()
    page.goto(f"/cases/{case}/checking")
    stands(page)
    page.get_by_role("button", name="Stop").click()
    page.wait_for_url(re.compile("/scan$"))
