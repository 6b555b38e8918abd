"""A family's browser, without a screen: keeps its cookies, fills in forms, follows the way through the pages."""

from __future__ import annotations

import json
import re
from typing import Any

import httpx

from lubdub.cases.database import Database
from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.report.archive import examination_to_bytes, outcome_to_bytes
from lubdub.results import Outcome
from lubdub.web.pages.questions import QUESTIONS
from tests.views import sample
from tests.web.service import eventually
from tests.web.visitor import Visitor

ABOUT = {"who": "child", "years": "6", "months": "0", "sex": "female", "posture": "supine"}
NO_STOPS = {"heart_on_right": "no", "chest_operation_or_device": "no", "late_pregnancy": "no"}


class Family(Visitor):
    """A family's browser at a running service."""

    def token(self, path: str = "/ask/who") -> str:
        """The form token of the session."""
        found = re.search(r'name="csrf_token" value="([0-9a-f]+)"', self.get(path))
        assert found is not None
        return found.group(1)

    def asked(self, **changes: str) -> str:
        """Answers every question; the path of the page the family then stands on."""
        said = ABOUT | NO_STOPS | changes
        for question in QUESTIONS:
            if question.is_asked(said):
                page = self.post(f"/ask/{question.name}", **{field: said[field] for field in question.fields})
        return page.url.path

    def consented(self, **changes: str) -> str:
        """A new case's id, before the instructions."""
        self.asked(**changes)
        page = self.post("/consent", agree="yes")
        if page.url.path == "/consent/child":
            page = self.post("/consent/child", child="yes")
        return case_in(str(page.url))

    def opened(self, **changes: str) -> str:
        """A new case's id, the instructions read."""
        case = self.consented(**changes)
        self.post(f"/cases/{case}/guide", app="file")
        self.post(f"/cases/{case}/ready")
        return case

    def send(self, case: str, scan: bytes) -> httpx.Response:
        """The scan by the plain form."""
        return self.http.post(
            f"/cases/{case}/scan",
            data={"csrf_token": self.token()},
            files={"scan": ("scan.ply", scan)},
            headers={"Origin": self.service.settings.address},
        )

    def where(self, case: str) -> str:
        """The step the case stands on."""
        return str(self.http.get(f"/cases/{case}").url).rsplit("/", 1)[1]

    def examined(self, scan: bytes = b"quick") -> str:
        """A case whose check found the sample chest."""
        case = self.opened()
        self.send(case, scan)
        eventually(lambda: self.where(case) == "size")
        self.vault.put(case, "examination.npz", examination_to_bytes(sample.examination()))
        return case

    def confirmed(self) -> str:
        """A case whose points can be placed."""
        case = self.examined()
        self.post(f"/cases/{case}/size", size="right", side="left")
        self.post(f"/cases/{case}/feel")
        return case

    def locate(self, case: str) -> None:
        """Asks for the places, and stays: a quick stand-in's result, which no page can read, may be there already."""
        data = {"csrf_token": self.token(), "action": "done"}
        origin = {"Origin": self.service.settings.address}
        answer = self.http.post(f"/cases/{case}/points", data=data, headers=origin, follow_redirects=False)
        assert answer.headers["location"] == f"/cases/{case}/waiting", answer.text[:500]

    def done(self, outcome: Outcome | None = None) -> str:
        """A case with a result."""
        case = self.confirmed()
        self.locate(case)
        eventually(lambda: self.rest_status(case) == "done")
        self.vault.put(case, "outcome.npz", outcome_to_bytes(outcome or sample.outcome()))
        return case

    def marks(self, case: str) -> dict[str, Any]:
        """What is stored of what was said about the points; empty when nothing was."""
        try:
            return dict(json.loads(self.vault.read(case, "marks.json")))
        except FileNotFound:
            return {}

    def rest_status(self, case: str) -> str:
        """The case's state as REST says it."""
        return str(self.http.get(f"/api/v1/cases/{case}").json()["status"])

    @property
    def vault(self) -> FileVault:
        """The service's files, to put results of our own where the stand-in worker left its own."""
        settings = self.service.settings
        return FileVault(Database(settings.database), settings.store, settings.master_key_source)


def case_in(url: str) -> str:
    """The case id in an address."""
    found = re.search(r"/cases/([0-9a-f]{32})", url)
    assert found is not None, url
    return found.group(1)
