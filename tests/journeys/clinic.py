"""A clinician at the desk: real results to review, browser windows that have the session, and what they show."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page

from lubdub.report.archive import outcome_from_bytes
from lubdub.results import AreaName
from lubdub.views.framing import FIELD_OF_VIEW, close_to, framed
from lubdub.views.stickers import AREA_STYLES
from tests.journeys.steps import middle_of_view
from tests.journeys.windows import new_window
from tests.web.reviewing import ORGANISATION, vault_of
from tests.web.service import ROOT, Service
from tests.web.staff import Desk, signed_in

DEMO = ROOT / "references" / "demo"
CHILD = DEMO / "phone-child"


def reviewed_soon(service: Service, number: str, body: Path = CHILD) -> str:
    """A real result, sent to the clinicians. body: the folder of a demo scan."""
    portal = service.portal(ORGANISATION)
    patient = json.loads((body / "patient.json").read_text())
    (scan,) = (file for file in body.iterdir() if file.suffix != ".json")
    case = portal.open_case(external_id=number, patient={"posture": "supine", **patient})
    portal.send(case, scan.read_bytes())
    portal.wait(case, "awaiting_landmarks")
    portal.call("PUT", f"/cases/{case}/landmarks", 202, json=json.loads((body / "landmarks.json").read_text()))
    portal.wait(case, "done")
    portal.call("POST", f"/cases/{case}/review", 200)
    return case


class Room:
    """A clinician's windows."""

    def __init__(self, service: Service, browser: Browser) -> None:
        self.desk: Desk = signed_in(service, "clinician", ORGANISATION)
        self._browser = browser
        self.contexts: list[BrowserContext] = []

    def window(self, size: str = "desk") -> Page:
        base = self.desk.service.settings.address
        context = new_window(self._browser, base, size)
        context.add_cookies(
            [{"name": one.name, "value": one.value or "", "url": base} for one in self.desk.http.cookies.jar]
        )
        self.contexts.append(context)
        return context.new_page()

    def close(self) -> None:
        for context in self.contexts:
            context.close()


def on_screen(page: Page, service: Service, case: str, area: AreaName) -> tuple[float, float]:
    """Where an area's letter is drawn after it was chosen, as page coordinates."""
    outcome = outcome_from_bytes(vault_of(service).read(case, "outcome.npz"))
    assert outcome.scan is not None
    box = page.locator("#frame").bounding_box()
    assert box is not None
    aspect = box["width"] / box["height"]
    camera = close_to(outcome.areas[area], framed(outcome.scan, outcome.landmarks, aspect))
    forward = camera.look_at - camera.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    seen = outcome.areas[area].position - camera.position
    half = np.tan(FIELD_OF_VIEW / 2) * (seen @ forward)
    across, up = seen @ right / (half * aspect), seen @ np.cross(right, forward) / half
    return middle_of_view(page, 0.5 + across / 2, 0.5 - up / 2)


def is_drawn_at(page: Page, area: AreaName, x: float, y: float) -> bool:
    """Whether the area's own colour surrounds this place of the page: its camera has arrived."""
    shot = page.screenshot(clip={"x": x - 12, "y": y - 12, "width": 24, "height": 24})
    picture = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), float)
    return bool((np.linalg.norm(picture - AREA_STYLES[area].colour, axis=2) < 40).mean() > 0.2)
