"""A family at home: its cases made quickly by HTTP, and browser windows that have its session."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, BrowserContext, Page

from tests.journeys.windows import new_window
from tests.web.family import Family
from tests.web.service import Service, eventually


class Home:
    """One family, its cases, and its browser windows."""

    def __init__(self, service: Service, browser: Browser) -> None:
        self.family = Family(service)
        self._browser = browser
        self.contexts: list[BrowserContext] = []

    def window(self, size: str = "phone", **more: object) -> Page:
        """A new browser window in which the family is known."""
        base = self.family.service.settings.address
        context = new_window(self._browser, base, size, **more)
        self.family.token()
        context.add_cookies(
            [{"name": one.name, "value": one.value or "", "url": base} for one in self.family.http.cookies.jar]
        )
        self.contexts.append(context)
        return context.new_page()

    def result(self, size: str = "phone", **more: object) -> Page:
        """A finished case's result."""
        page = self.window(size, **more)
        page.goto(f"/cases/{self.family.done()}/result")
        return page

    def before_sending(self, page: Page) -> Page:
        """A new case, all questions answered, where its scan is sent."""
        page.goto(f"/cases/{self.family.opened()}/scan")
        return page

    def at_the_points(self, page: Page, scan: Path) -> Page:
        """A new case with this scan, its size and sides confirmed and the bones taught, where points are marked."""
        case = self.family.opened()
        self.family.send(case, scan.read_bytes())
        eventually(lambda: self.family.where(case) == "size", seconds=120)
        self.family.post(f"/cases/{case}/size", size="right", side="left")
        self.family.post(f"/cases/{case}/feel")
        page.goto(f"/cases/{case}/points")
        return page

    def close(self) -> None:
        """Closes its windows."""
        for context in self.contexts:
            context.close()
