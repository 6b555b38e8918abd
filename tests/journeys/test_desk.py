"""The desk in a real browser: an account and sign-in with a passkey, and every page by day and night."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.journeys.steps import leads_on, stands
from tests.journeys.windows import new_window
from tests.web.service import Service
from tests.web.staff import grow_old, new_account, staff_of

pytestmark = pytest.mark.browser


@pytest.fixture(params=["desk", "phone"])
def desk_page(quick: Service, browser: Browser, request: pytest.FixtureRequest) -> Iterator[Page]:
    """A window of the desk whose device has a place for passkeys and a finger on it."""
    context = new_window(browser, quick.settings.desk_address, request.param)
    page = context.new_page()
    device = context.new_cdp_session(page)
    device.send("WebAuthn.enable")
    authenticator = {
        "protocol": "ctap2",
        "transport": "internal",
        "hasResidentKey": True,
        "hasUserVerification": True,
        "isUserVerified": True,
        "automaticPresenceSimulation": True,
    }
    device.send("WebAuthn.addVirtualAuthenticator", {"options": authenticator})
    yield page
    context.close()


PAGES = (
    "/desk",
    "/desk/account",
    "/desk/account/password",
    "/desk/families",
    "/desk/audit?check=true",
    "/desk/holds",
    "/desk/references",
    "/desk/people",
)


def test_a_passkey_makes_the_account_and_opens_it_again(quick: Service, desk_page: Page) -> None:
    email = joins(quick, desk_page)
    for path in PAGES:
        desk_page.goto(path)
        stands(desk_page)
    invites_a_colleague(desk_page)
    invited = invites_a_family(desk_page)
    leaves_and_comes_back(desk_page)
    asked_again(quick, desk_page, email)
    family_arrives(desk_page, invited)


def joins(quick: Service, page: Page) -> str:
    """By an invitation, with a passkey and a name; returns the e-mail address."""
    of = new_account(quick, "administrator", "Harbour House").clinician
    with staff_of(quick.settings) as (staff, _database):
        link = staff.invitations.offer(of.actor, "administrator").token
    page.goto(f"/desk/join#{link}")
    stands(page)
    expect(page).not_to_have_url(re.compile(re.escape(link)))
    with leads_on(page):
        page.get_by_role("button", name="Continue").click()
    passkey = page.get_by_role("button", name="Go on with a passkey")
    stands(page)
    passkey.click()
    expect(page.locator("#passkey-fault")).to_contain_text("Type your name")
    page.get_by_label("Your name").fill("Bo Sun")
    email = f"bo-{page.viewport_size['width'] if page.viewport_size else 0}@harbour.example"
    page.get_by_label("E-mail").fill(email)
    passkey.click()
    page.wait_for_url(re.compile("/desk$"))
    expect(page.get_by_text("Harbour House")).to_be_visible()
    return email


def invites_a_colleague(page: Page) -> None:
    page.goto("/desk/people")
    with leads_on(page):
        page.get_by_role("button", name="Make a link").click()
    expect(page.get_by_role("status")).to_contain_text("/desk/join#")
    stands(page)


def invites_a_family(page: Page) -> str:
    """Returns the link that the family is sent."""
    page.goto("/desk/families")
    page.get_by_label("Your own number").fill("H-7")
    page.get_by_label("Date of birth").fill("2020-05-17")
    with leads_on(page):
        page.get_by_role("button", name="Make a link").click()
    stands(page)
    text = page.get_by_label("Text to send").input_value()
    page.goto("/desk/families")
    expect(page.get_by_role("row", name="H-7").first).to_contain_text("Not opened yet")
    stands(page)
    return str(text.split("\n")[1])


def leaves_and_comes_back(page: Page) -> None:
    """Signs out, and in again with the passkey, to the page that was asked for."""
    with leads_on(page):
        page.get_by_role("button", name="Sign out").click()
    page.wait_for_url(re.compile("/desk/sign-in$"))
    stands(page)
    page.goto("/desk/account")
    page.get_by_role("button", name="Sign in with a passkey").click()
    page.wait_for_url(re.compile("/desk/account$"))
    expect(page.get_by_text("Bo Sun").first).to_be_visible()


def asked_again(quick: Service, page: Page, email: str) -> None:
    """Too long after signing in, one more passkey asks for the one there is, and leads back."""
    with staff_of(quick.settings) as (staff, _database):
        who = staff.clinicians.find(email)
    assert who is not None
    grow_old(quick, who)
    page.get_by_role("button", name="Add a passkey").click()
    page.wait_for_url(re.compile(r"/desk/sign-in\?again=1"))
    expect(page.get_by_text("Sign in once more")).to_be_visible()
    stands(page)
    page.get_by_role("button", name="Sign in with a passkey").click()
    page.wait_for_url(re.compile("/desk/account$"))


def family_arrives(page: Page, link: str) -> None:
    """The family's side of an invitation, with a date of birth."""
    page.goto(link)
    expect(page.get_by_label("The code in the link")).to_have_value(link.partition("#")[2])
    stands(page)
    with leads_on(page):
        page.get_by_role("button", name="Start").click()
    stands(page)
    page.get_by_label("When was the person").fill("2020-05-17")
    with leads_on(page):
        page.get_by_role("button", name="Continue").click()
    expect(page.get_by_text("Harbour House asks you for a scan")).to_be_visible()
    stands(page)
