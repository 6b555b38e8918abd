"""From computer to phone and back, with a camera's eye on the picture code."""

from __future__ import annotations

import io
import re
from typing import Literal

import pytest
import zxingcpp
from PIL import Image
from playwright.sync_api import Page, expect

from tests.journeys.conftest import OpenPage
from tests.journeys.home import Home
from tests.journeys.steps import leads_on, stands

pytestmark = pytest.mark.browser


def seen_by_a_camera(page: Page, scheme: Literal["dark", "light"]) -> str:
    page.emulate_media(color_scheme=scheme)
    picture = Image.open(io.BytesIO(page.locator(".code-picture").screenshot()))
    found = zxingcpp.read_barcodes(picture)
    assert len(found) == 1
    return found[0].text


def test_a_scan_moves_to_the_phone_and_back(home: Home, open_page: OpenPage) -> None:
    computer, phone = home.before_sending(home.window("desk")), open_page("phone")
    with leads_on(computer):
        computer.get_by_role("link", name="The scan is on another phone or computer").click()
    stands(computer)
    with leads_on(computer):
        computer.get_by_role("button", name="Show me the code").click()
    stands(computer)
    assert "#" not in computer.url
    address = seen_by_a_camera(computer, "light")
    assert seen_by_a_camera(computer, "dark") == address

    phone.goto(address)
    code = address.partition("#")[2]
    expect(phone.get_by_label("The code from the other device")).to_have_value(code)
    expect(phone).not_to_have_url(re.compile(code))
    stands(phone)
    with leads_on(phone):
        phone.get_by_role("button", name="Go on here").click()
    phone.wait_for_url(re.compile("/scan$"))

    expect(computer.get_by_role("heading", name="Your other device has it now")).to_be_visible()
    expect(computer.get_by_text("Delete everything")).to_have_count(0)
    stands(computer)
    with leads_on(computer):
        computer.get_by_role("button", name="Bring it back here").click()
    with leads_on(phone):
        phone.get_by_role("link", name="Go on with another phone or computer").click()
    with leads_on(phone):
        phone.get_by_role("button", name="Show me the code").click()
    stands(phone)
    typed = phone.locator(".code-signs").inner_text()
    computer.get_by_label("The code from the other device").fill(typed.lower())
    computer.keyboard.press("Enter")
    computer.wait_for_url(re.compile("/scan$"))


def test_a_spent_code_is_told_and_another_can_be_typed(open_page: OpenPage) -> None:
    page = open_page("phone")
    page.goto("/handoff#ABCD-EFGH-JKMN-PQRS")
    with leads_on(page):
        page.get_by_role("button", name="Go on here").click()
    expect(page.get_by_role("alert")).to_contain_text("does not work")
    stands(page)
