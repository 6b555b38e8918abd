"""Every page in each language that is spoken: nothing sticks out, and axe-core has no complaint."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, Page

from lubdub.web.pages.guide_words import APPS
from lubdub.web.pages.questions import QUESTIONS
from tests.journeys.home import Home
from tests.journeys.steps import faults, keep_picture, small_targets
from tests.web.family import Family
from tests.web.service import Service

pytestmark = pytest.mark.browser


def see(page: Page, path: str, language: str) -> None:
    """The page in its language, whole on a phone and open to everybody."""
    page.goto(path)
    assert page.get_attribute("html", "lang") == language
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), f"{page.url} is too wide"
    assert small_targets(page) == [], page.url
    found = faults(page)
    assert not found, "\n".join([page.url, *found])
    keep_picture(page, language)


def paths_before_a_case(family: Family) -> list[str]:
    family.asked(years="9")
    family.post("/consent", agree="yes")
    return ["/", *(f"/ask/{question.name}" for question in QUESTIONS), "/consent", "/consent/child", "/not-now"]


def paths_of_a_result(family: Family) -> list[str]:
    case = family.done()
    return [f"/cases/{case}/{step}" for step in ("size", "feel", "points", "result", "remove", "handoff")]


@pytest.mark.parametrize("language", ["es", "ja"])
def test_every_page_stands_in_every_language(quick: Service, browser: Browser, language: str) -> None:
    home = Home(quick, browser)
    family = home.family
    family.http.cookies.set("lubdub_language", language, domain="127.0.0.1")
    page = home.window(locale=language)
    page.route("**/view/**", lambda route: route.abort())
    page.route("**/picture", lambda route: route.abort())
    for path in paths_before_a_case(family):
        see(page, path, language)
    case = family.opened(years="9")
    for step in ("guide", *(f"guide/{app}" for app in APPS), "ready", "scan"):
        see(page, f"/cases/{case}/{step}", language)
    for path in paths_of_a_result(family):
        see(page, path, language)
    home.close()
