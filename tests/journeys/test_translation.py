"""Every page in other languages: nothing stays English, and a long language from the right breaks nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import NamedTuple

import pytest
from playwright.sync_api import Browser, Page, expect

from lubdub.settings import Settings
from lubdub.web.pages.guide_words import APPS
from lubdub.web.pages.questions import QUESTIONS
from tests.journeys import pseudo
from tests.journeys.steps import keep_picture, leads_on, small_targets
from tests.journeys.windows import SIZES, new_window
from tests.web.family import Family
from tests.web.service import Service, free_port

pytestmark = pytest.mark.browser

APP_NAMES = ["Scaniverse", "3d Scanner App", "Polycam", "KIRI Engine", "Record3D"]
ALLOWED = ["Lubdub", "lubdub", "English", "Español", "日本語", *APP_NAMES, "sample"]
"""Names, which stay; `sample` is that of the stand-in's reference body."""

UNTRANSLATED = """
allowed => {
  const texts = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    if (!node.parentElement.closest("script, style, noscript, template, .code-signs, address, code, time"))
      texts.push(node.data);
  }
  for (const element of document.querySelectorAll("[aria-label], [title], [placeholder], [alt]"))
    for (const name of ["aria-label", "title", "placeholder", "alt"]) texts.push(element.getAttribute(name) ?? "");
  texts.push(document.title);
  const left = [];
  for (const text of texts) {
    let rest = text;
    for (let before = ""; before !== rest; ) [before, rest] = [rest, rest.replace(/⟦[^⟦⟧]*⟧/g, "")];
    for (const name of allowed) rest = rest.replaceAll(name, "");
    if (/[A-Za-z]{3,}/.test(rest)) left.push(text.trim());
  }
  return left;
}
"""


class Foreign(NamedTuple):
    """A service that speaks the made-up language, a family there, and a browser with its session."""

    family: Family
    page: Page


@pytest.fixture(scope="module")
def foreign_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("foreign")
    words = folder / "words"
    pseudo.write_catalogue(words)
    settings = Settings(
        data_dir=folder / "data", port=free_port(), requests_per_minute=100_000, clinic_name="⟦Clinic⟧", job_cpu_s=1
    )
    program = f"from tests.journeys.pseudo import run; run({json.dumps(str(words))})"
    running = Service(settings, web_program=program)
    try:
        running.start_web()
        running.start_worker()
        yield running
    finally:
        running.stop()


@pytest.fixture(params=sorted(SIZES))
def foreign(foreign_service: Service, browser: Browser, request: pytest.FixtureRequest) -> Iterator[Foreign]:
    family = Family(foreign_service)
    family.http.cookies.set("lubdub_language", pseudo.CODE, domain="127.0.0.1")
    family.token()
    context = new_window(browser, foreign_service.settings.address, request.param, locale="he")
    address = foreign_service.settings.address
    context.add_cookies(
        [{"name": one.name, "value": str(one.value), "url": address} for one in family.http.cookies.jar]
    )
    context.route("**/view/**", lambda route: route.abort())
    context.route("**/picture", lambda route: route.abort())
    yield Foreign(family, context.new_page())
    context.close()


def see(page: Page, path: str) -> None:
    """The page, which must be whole from the right and have no English word."""
    page.goto(path)
    assert page.evaluate("getComputedStyle(document.body).direction") == "rtl"
    assert page.evaluate(UNTRANSLATED, ALLOWED) == [], page.url
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), f"{page.url} is too wide"
    assert small_targets(page) == [], page.url
    keep_picture(page, "foreign")


def test_every_page_before_a_case_is_whole(foreign: Foreign) -> None:
    for path in ("/", "/handoff", "/cases/" + "0" * 32):
        see(foreign.page, path)
    foreign.family.asked()
    for path in (*(f"/ask/{question.name}" for question in QUESTIONS), "/consent"):
        see(foreign.page, path)
    foreign.family.post("/consent", agree="yes")
    see(foreign.page, "/consent/child")


def test_a_stop_is_whole(foreign: Foreign) -> None:
    foreign.family.asked(heart_on_right="yes")
    see(foreign.page, "/stop")


def test_every_page_around_the_scan_is_whole(foreign: Foreign) -> None:
    case = foreign.family.consented()
    for step in ("guide", *(f"guide/{app}" for app in APPS), "ready", "remove", "handoff"):
        see(foreign.page, f"/cases/{case}/{step}")
    foreign.family.post(f"/cases/{case}/ready")
    see(foreign.page, f"/cases/{case}/scan")
    foreign.page.goto(f"/cases/{case}/handoff")
    with leads_on(foreign.page):
        foreign.page.locator("main form button").click()
    expect(foreign.page.locator(".code-signs")).to_be_visible()
    assert foreign.page.evaluate(UNTRANSLATED, [*ALLOWED, foreign.family.service.settings.address]) == []


def test_every_page_of_marking_is_whole(foreign: Foreign) -> None:
    case = foreign.family.examined()
    see(foreign.page, f"/cases/{case}/size")
    foreign.family.post(f"/cases/{case}/size", size="right", side="left")
    see(foreign.page, f"/cases/{case}/feel")
    foreign.family.post(f"/cases/{case}/feel")
    see(foreign.page, f"/cases/{case}/points")


def test_the_result_and_what_comes_after_it_are_whole(foreign: Foreign) -> None:
    case = foreign.family.done()
    see(foreign.page, f"/cases/{case}/result")
    foreign.family.post(f"/cases/{case}/send")
    see(foreign.page, f"/cases/{case}/result")
    foreign.family.post(f"/cases/{case}/remove")
    see(foreign.page, f"/cases/{case}/removed")


def complain(page: Page, path: str) -> None:
    """Send a page's form with nothing in it: the answer must be whole too."""
    page.goto(path)
    with leads_on(page):
        page.evaluate(
            """() => {
                const form = document.querySelector("main form");
                for (const field of form.querySelectorAll("input:not([type=hidden])"))
                    if (["radio", "checkbox"].includes(field.type)) field.checked = false; else field.value = "";
                HTMLFormElement.prototype.submit.call(form);
            }"""
        )
    expect(page.locator(".nhsuk-error-summary")).to_be_visible()
    assert page.evaluate(UNTRANSLATED, ALLOWED) == [], page.url
    keep_picture(page, "foreign-complaint")


def test_every_complaint_is_whole(foreign: Foreign) -> None:
    foreign.family.asked()
    for path in (*(f"/ask/{question.name}" for question in QUESTIONS), "/consent", "/handoff"):
        complain(foreign.page, path)
    foreign.family.post("/consent", agree="yes")
    complain(foreign.page, "/consent/child")
    case = foreign.family.opened()
    complain(foreign.page, f"/cases/{case}/scan")
    complain(foreign.page, f"/cases/{foreign.family.examined()}/size")


@pytest.mark.parametrize("order", [b"crash", b"memory"])
def test_a_refusal_is_whole(foreign: Foreign, order: bytes) -> None:
    case = foreign.family.opened()
    foreign.family.send(case, order)
    foreign.page.goto(f"/cases/{case}")
    foreign.page.wait_for_url("**/refused")
    see(foreign.page, f"/cases/{case}/refused")
