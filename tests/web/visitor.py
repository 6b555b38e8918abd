"""A browser without a screen: keeps its cookies and sends forms as our own pages would."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import httpx

from tests.web.service import Service


@dataclass
class Visitor(ABC):
    """One browser at a running service."""

    service: Service
    http: httpx.Client = field(init=False)

    def __post_init__(self) -> None:
        self.http = httpx.Client(base_url=self.service.settings.address, timeout=30, follow_redirects=True)

    @abstractmethod
    def token(self) -> str:
        """The form token of this browser."""

    def get(self, path: str, expect: int = 200) -> str:
        """A page's HTML."""
        answer = self.http.get(path)
        assert answer.status_code == expect, answer.text[:500]
        return answer.text

    def post(self, path: str, expect: int = 200, token: str | None = None, **fields: str) -> httpx.Response:
        """Send a form as a page of ours would."""
        data = {"csrf_token": self.token() if token is None else token, **fields}
        answer = self.http.post(path, data=data, headers={"Origin": self.service.settings.address})
        assert answer.status_code == expect, answer.text[:500]
        return answer
