"""The real service for tests: web and worker as processes of their own, in a folder of their own."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from lubdub.cases import admin
from lubdub.jobs.engine import UNTIL_INPUT_CLOSES
from lubdub.settings import Settings

ROOT = Path(__file__).parents[2]
PATIENT = {"age_years": 6, "sex": "female", "posture": "supine"}
NO_STOPS = {"heart_on_right": False, "chest_operation_or_device": False, "late_pregnancy": False}
WEB = "from lubdub.settings import Settings; from lubdub.web.serve import run_web; run_web(Settings())"


def free_port(in_a_row: int = 1) -> int:
    """A port nobody listens on, the first of so many: a worker's numbers have the port after those of its web."""
    while True:
        with contextlib.ExitStack() as stack:
            first = _bound(stack, 0)
            with contextlib.suppress(OSError, OverflowError):
                for number in range(1, in_a_row):
                    _bound(stack, first + number)
                return first


def _bound(stack: contextlib.ExitStack, port: int) -> int:
    listening = stack.enter_context(socket.socket())
    listening.bind(("127.0.0.1", port))
    return int(listening.getsockname()[1])


def eventually(happens: Callable[[], Any], seconds: float = 120.0) -> Any:
    """The first true thing happens() returns. Fails when nothing comes."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if outcome := happens():
            return outcome
        time.sleep(0.1)
    raise AssertionError("it did not happen in time")


@dataclass
class Service:
    """A running service. `key` is a portal's token."""

    settings: Settings
    worker_module: str = "tests.jobs.stand_in_worker"
    web_program: str = WEB
    processes: list[subprocess.Popen[bytes]] = field(default_factory=list)
    address: str = ""
    """Where this process itself listens, when people use another address."""

    def __post_init__(self) -> None:
        self.address = self.address or self.settings.address

    @property
    def log(self) -> Path:
        return self.settings.data_dir.parent / "log.jsonl"

    def start_web(self) -> subprocess.Popen[bytes]:
        process = self.spawn([sys.executable, "-c", self.web_program])
        eventually(lambda: self._answers() or process.poll() is not None, seconds=180)  # a busy machine starts slowly
        assert process.poll() is None, self.log.read_text()[-3000:]
        return process

    def start_worker(self, on_a_leash: bool = False) -> subprocess.Popen[bytes]:
        """on_a_leash: as `lubdub serve` starts it, to end when its standard input closes."""
        numbers = {"LUBDUB_METRICS_PORT": str(self.settings.metrics_port + 1)} if self.settings.metrics_port else {}
        command = [sys.executable, "-m", self.worker_module]
        if on_a_leash:
            return self.spawn([*command, UNTIL_INPUT_CLOSES], numbers, subprocess.PIPE)
        return self.spawn(command, numbers)

    def spawn(
        self, command: list[str], more: Mapping[str, str] | None = None, stdin: int | None = None
    ) -> subprocess.Popen[bytes]:
        environment = os.environ | self.settings.to_environment()
        environment |= dict(more or {})
        environment |= {"PYTHONPATH": f"{ROOT / 'backend'}{os.pathsep}{ROOT}", "OMP_NUM_THREADS": "1"}
        with self.log.open("ab") as log:
            process = subprocess.Popen(command, env=environment, cwd=ROOT, stdin=stdin, stdout=log, stderr=log)
        self.processes.append(process)
        return process

    def stop(self) -> None:
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdin is not None:
                process.stdin.close()

    def portal(self, name: str = "clinic", scopes: tuple[str, ...] = ("cases:read", "cases:write")) -> Portal:
        _, token = admin.create_key(self.settings.database, name, scopes)
        headers = {"Authorization": f"Bearer {token}"}
        return Portal(httpx.Client(base_url=self.settings.address, headers=headers, timeout=30))

    def browser(self) -> httpx.Client:
        return httpx.Client(base_url=self.settings.address, timeout=30)

    def _answers(self) -> bool:
        try:
            return httpx.get(f"{self.address}/livez").status_code == 200
        except httpx.TransportError:
            return False


@dataclass
class Portal:
    """A portal's program."""

    http: httpx.Client

    def call(self, method: str, path: str, expect: int, **more: Any) -> httpx.Response:
        response = self.http.request(method, f"/api/v1{path}", **more)
        assert response.status_code == expect, response.text
        return response

    def open_case(self, **changes: Any) -> str:
        body = {"patient": PATIENT, "answers": NO_STOPS} | changes
        return str(self.call("POST", "/cases", 201, json=body).json()["id"])

    def send(self, case: str, scan: bytes, expect: int = 202) -> httpx.Response:
        return self.call("PUT", f"/cases/{case}/scan", expect, content=scan)

    def state(self, case: str) -> dict[str, Any]:
        return dict(self.call("GET", f"/cases/{case}", 200).json())

    def wait(self, case: str, *statuses: str) -> dict[str, Any]:
        def arrived() -> dict[str, Any] | None:
            state = self.state(case)
            return state if state["status"] in statuses else None

        return dict(eventually(arrived))

    def examined(self, scan: bytes) -> str:
        case = self.open_case()
        self.send(case, scan)
        self.wait(case, "awaiting_landmarks")
        return case

    def done(self, scan: bytes) -> str:
        case = self.examined(scan)
        self.call("PUT", f"/cases/{case}/landmarks", 202, json={})
        self.wait(case, "done")
        return case
