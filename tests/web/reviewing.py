"""Cases in review, and a clinician who looks at them in a picture without a browser."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable
from typing import Any

import viser
import websockets
from websockets.typing import Subprotocol

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.report.archive import outcome_to_bytes
from lubdub.results import Outcome
from tests.views import sample
from tests.web.service import Portal, Service
from tests.web.staff import Desk

ORGANISATION = "Heart House"
CURRENT = Subprotocol(f"viser-v{viser.__version__}")


def in_review(service: Service, organisation: str = ORGANISATION, outcome: Outcome | None = None, **said: Any) -> str:
    """A case of an organisation whose result was sent to its clinicians."""
    portal: Portal = service.portal(organisation)
    case = portal.open_case(**said)
    portal.send(case, b"quick")
    portal.wait(case, "awaiting_landmarks")
    portal.call("PUT", f"/cases/{case}/landmarks", 202, json={})
    portal.wait(case, "done")
    vault_of(service).put(case, "outcome.npz", outcome_to_bytes(outcome or sample.outcome()))
    assert portal.call("POST", f"/cases/{case}/review", 200).json()["status"] == "in_review"
    return case


def vault_of(service: Service) -> FileVault:
    settings = service.settings
    return FileVault(Database(settings.database), settings.store, settings.master_key_source)


def dial(desk: Desk, case: str, window: str, origin: str | None = None) -> Any:
    """The view's socket, as the page in a clinician's browser opens it."""
    address = desk.service.settings.address
    cookies = "; ".join(f"{name}={value}" for name, value in desk.http.cookies.items())
    return websockets.connect(
        address.replace("http", "ws") + f"/desk/view/{case}/{window}",
        origin=address if origin is None else origin,  # type: ignore[arg-type]
        additional_headers={"Cookie": cookies},
        subprotocols=[CURRENT],
        max_size=None,
    )


def with_picture(desk: Desk, case: str, act: Callable[[str, Any], Awaitable[Any]]) -> Any:
    """Do something while a window with the case's picture is open. act: given the window's word and the socket."""
    window = secrets.token_hex(4)
    desk.get(f"/desk/view/{case}/{window}/")

    async def run() -> Any:
        async with dial(desk, case, window) as socket:
            await asyncio.wait_for(socket.recv(), 20)
            return await act(window, socket)

    return asyncio.run(run())


class Hand:
    """Presses the review page's buttons."""

    def __init__(self, desk: Desk, case: str) -> None:
        self.desk, self.case = desk, case
        self.version = 0
        self.token = desk.token()

    def press(self, action: str, expect: int = 200, **fields: str) -> dict[str, Any]:
        data = {"csrf_token": self.token, "action": action, "version": str(self.version), **fields}
        headers = {"Origin": self.desk.service.settings.address, "Accept": "application/json"}
        answer = self.desk.http.post(f"/desk/cases/{self.case}/review", data=data, headers=headers)
        assert answer.status_code == expect, answer.text[:500]
        said = dict(answer.json())
        self.version = said.get("version", self.version)
        return said

    def look_at_all(self) -> None:
        async def looked(window: str, socket: Any) -> None:
            for area in ("aortic", "pulmonary", "tricuspid", "mitral"):
                await asyncio.to_thread(self.press, "look", area=area, window=window)

        with_picture(self.desk, self.case, looked)
