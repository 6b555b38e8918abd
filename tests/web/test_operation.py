"""What an operations team lives by: ids through all processes, numbers, readiness, and stopping without loss."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import websockets

from lubdub.web.api.uploads import PIECE
from tests.web.api.test_uploads import begin, path_of, piece, stands_at
from tests.web.family import Family
from tests.web.pages.test_view import CURRENT
from tests.web.replicas import replicas
from tests.web.service import Portal, Service, eventually


def logged(service: Service, event: str, **fields: str) -> list[dict[str, Any]]:
    lines = [json.loads(line) for line in service.log.read_text().splitlines() if line.startswith("{")]
    return [line for line in lines if line["event"].startswith(event) and fields.items() <= line.items()]


def taken_in(service: Service) -> float:
    """Bytes of scans that came into the web process."""
    return float(re.findall(r"(?m)^lubdub_upload_bytes_total (\S+)$", numbers(service))[0])


def numbers(service: Service, beside: int = 0) -> str:
    """What Prometheus would scrape from the web process, or from the worker beside it."""
    return httpx.get(f"http://127.0.0.1:{service.settings.metrics_port + beside}/metrics").text


def test_the_id_of_a_call_stands_in_the_log_of_its_job_and_of_the_child(service: Service, portal: Portal) -> None:
    portal.examined(b"quick")  # the worker takes jobs: none has to be found by its sweep
    case = portal.open_case()
    asked = portal.send(case, b"crash").headers["x-request-id"]
    portal.wait(case, "refused")
    (ended,) = eventually(lambda: logged(service, "a job ended", request_id=asked))
    assert ended["job_id"] == f"{case}.check.1"
    assert logged(service, "a sandboxed child ended without an answer", request_id=asked)
    assert logged(service, "answered", request_id=asked)[0]["route"] == "/api/v1/cases/{case_id}/scan"


def test_numbers_tell_what_goes_on_and_never_of_whom(service: Service, portal: Portal) -> None:
    case = portal.done(b"quick")
    web, worker = numbers(service), numbers(service, 1)
    assert 'lubdub_http_requests_total{method="PUT",route="/api/v1/cases/{case_id}/scan",status="202"}' in web
    assert 'lubdub_waiting{what="queued"} ' in web
    assert 'lubdub_jobs_total{kind="locate",outcome="done"}' in worker
    assert 'lubdub_child_ends_total{how="ok"}' in worker
    assert case not in web + worker
    service.browser().request("MADEUP", f"/cases/{case}/nothing")
    again = numbers(service)
    assert "MADEUP" not in again
    assert case not in again


def test_numbers_are_not_among_the_pages(service: Service) -> None:
    assert service.browser().get("/metrics").status_code == 404


def test_whoever_listens_is_counted_while_listening(service: Service, portal: Portal) -> None:
    with portal.http.stream("GET", f"/api/v1/cases/{portal.open_case()}/events") as listening:
        lines = listening.iter_lines()
        next(lines)
        assert "lubdub_event_streams_open 0.0" not in numbers(service)


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[list[Service]]:
    with replicas("sqlite", tmp_path, max_upload_mb=20, stop_s=5) as services:
        services[0].start_worker()
        eventually(lambda: httpx.get(f"{services[0].settings.address}/readyz").status_code == 200, seconds=240)
        yield services


@pytest.mark.timeout(900)
def test_an_upgrade_one_by_one_loses_no_upload_no_job_and_no_view(pair: list[Service]) -> None:
    old, new = pair
    family = Family(old)
    viewed = family.confirmed()
    family.get(f"/view/{viewed}/")
    portal, elsewhere = old.portal("upgrade"), new.portal("upgrade")
    case = portal.open_case()
    path = path_of(begin(portal, case, 3_000_000))
    code = asyncio.run(_watched_until_stopped(family, viewed, old, lambda: _half_sent(portal, path)))
    assert code == 1012, "the page is told that the service restarts, and loads the view again"
    assert old.processes[0].wait(30) in (0, -signal.SIGTERM)
    here = stands_at(elsewhere, path)
    assert here >= 1_000_000, "what had arrived is there"
    piece(elsewhere, path, here, b"x" * (3_000_000 - here - 5) + b"quick")
    elsewhere.wait(case, "awaiting_landmarks", "refused")
    moved = httpx.Client(base_url=new.settings.address, cookies=family.http.cookies, timeout=60)
    assert moved.get(f"/view/{viewed}/").status_code == 200
    del old.processes[0]
    old.start_web()
    assert portal.state(case)["status"] in ("awaiting_landmarks", "refused")


def _half_sent(portal: Portal, path: str) -> socket.socket:
    """A piece whose first megabyte is on the way, and the rest never comes while the server lives."""
    base = portal.http.base_url
    line = socket.create_connection((base.host, base.port or 80))
    head = [
        f"PATCH /api/v1{path} HTTP/1.1",
        "Host: 127.0.0.1",
        f"Authorization: {portal.http.headers['authorization']}",
        "Tus-Resumable: 1.0.0",
        "Upload-Offset: 0",
        f"Content-Type: {PIECE}",
        "Content-Length: 3000000",
    ]
    line.sendall(("\r\n".join(head) + "\r\n\r\n").encode() + b"x" * 1_000_000)
    return line


async def _watched_until_stopped(family: Family, case: str, service: Service, send: Any) -> int | None:
    address = service.settings.address
    cookies = "; ".join(f"{name}={value}" for name, value in family.http.cookies.items())
    async with websockets.connect(
        f"{address.replace('http', 'ws')}/view/{case}",
        origin=address,  # type: ignore[arg-type]
        additional_headers={"Cookie": cookies},
        subprotocols=[CURRENT],
        max_size=None,
    ) as watching:
        await asyncio.wait_for(watching.recv(), 60)
        before = taken_in(service)
        line = await asyncio.to_thread(send)
        await asyncio.to_thread(eventually, lambda: taken_in(service) >= before + 1_000_000)
        service.processes[0].send_signal(signal.SIGTERM)
        line.sendall(b"x" * 10_000)
        await asyncio.wait_for(watching.wait_closed(), 60)
        line.close()
        return watching.close_code
