"""Traces: real processes, a collector that reads what they send, and nothing in it that names anybody."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from pydantic import ValidationError

from lubdub.jobs.tracing import ALLOWED, INSTALL
from lubdub.settings import Settings
from tests.jobs.collector import Collector, collector
from tests.rules.source import ROOT
from tests.web.service import WEB, Portal, Service, eventually, free_port

SCAN_ROUTE = "/api/v1/cases/{case_id}/scan"
WORKER = "from lubdub.settings import Settings; from lubdub.jobs.worker import run_worker; run_worker(Settings())"
WITHOUT_PACKAGES = "import sys; sys.modules['opentelemetry.sdk'] = sys.modules['opentelemetry.exporter'] = None; "
"""The web framework brings `opentelemetry` itself, which is an empty frame without these."""
OFF = """
import sys
from lubdub.jobs.tracing import JobTrace, check_traceable, start_tracing, trace_call, trace_job
from lubdub.settings import Settings
from lubdub.web.app import create_app
import lubdub.jobs.worker
settings = Settings()
check_traceable(settings)
end = start_tracing(settings, "web")
create_app(settings)
trace_call("00000000000000ab", "GET", "/", 200, 1)
trace_job(JobTrace("check", ""))
end()
loaded = ("opentelemetry.sdk", "opentelemetry.exporter", "lubdub.jobs.otlp")
print([name for name in sys.modules if name.startswith(loaded)])
"""


@pytest.fixture(scope="module")
def told() -> Iterator[Collector]:
    with collector() as kept:
        yield kept


@pytest.fixture(scope="module")
def service(told: Collector, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("traced")
    running = Service(Settings(data_dir=folder / "data", port=free_port(), otlp_url=told.url))
    try:
        with pytest.MonkeyPatch.context() as patch:
            # The web framework's own traces tell paths and query strings; even these must not bring them out.
            patch.setenv("FASTAPI_OTEL_AUTO_CONFIGURE", "true")
            patch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", told.url)
            running.start_web()
            running.start_worker()
        eventually(lambda: httpx.get(f"{running.address}/readyz").status_code == 200, seconds=240)
        yield running
    finally:
        running.stop()


@pytest.fixture(scope="module")
def portal(service: Service) -> Portal:
    portal = service.portal()
    portal.examined(b"quick")  # the worker takes jobs: none has to be found by its sweep
    return portal


def test_a_job_stands_in_the_trace_of_the_call_that_asked_for_it(portal: Portal, told: Collector) -> None:
    case = portal.open_case()
    asked = portal.send(case, b"quick").headers["x-request-id"]
    portal.wait(case, "awaiting_landmarks")
    (call,) = eventually(lambda: told.named(f"PUT {SCAN_ROUTE}", lubdub__request_id=asked))
    (job,) = eventually(lambda: told.named("job check", lubdub__request_id=asked))
    assert {path for path, _ in told.taken} == {"/v1/traces"}
    assert (call.service, job.service) == ("lubdub-web", "lubdub-worker")
    assert (call.trace, call.id, call.parent) == (asked.zfill(32), asked, "")
    assert (job.trace, job.parent) == (call.trace, call.id)
    assert job.id != call.id
    assert call.attributes == {
        "http.request.method": "PUT",
        "http.route": SCAN_ROUTE,
        "http.response.status_code": 202,
        "lubdub.request_id": asked,
    }
    assert job.attributes == {
        "lubdub.job.kind": "check",
        "lubdub.job.stage": "read",
        "lubdub.job.outcome": "awaiting_landmarks",
        "lubdub.request_id": asked,
    }
    assert job.events == ["read"]
    assert not call.is_fault
    assert not job.is_fault


def test_a_job_that_failed_is_a_fault_in_its_trace_without_its_message(portal: Portal, told: Collector) -> None:
    case = portal.open_case()
    asked = portal.send(case, b"bug").headers["x-request-id"]
    portal.wait(case, "failed")
    (job,) = eventually(lambda: told.named("job check", lubdub__request_id=asked))
    assert job.is_fault
    assert job.attributes["lubdub.job.outcome"] == "failed"
    assert not any(b"a bug of ours" in body for _, body in told.taken)


def test_no_span_names_a_case_a_person_or_what_was_typed(service: Service, portal: Portal, told: Collector) -> None:
    case = portal.done(b"quick")
    visitor = service.browser()
    visitor.get(
        f"/api/v1/cases/{case}/result?name=Emma-Typed", headers={"traceparent": f"00-{'ab' * 16}-{'cd' * 8}-01"}
    )
    visitor.get("/Emma-Unknown")
    visitor.request("EMMAMETHOD", f"/cases/{case}/nothing", headers={"User-Agent": "Emma-Agent"})
    last = visitor.get("/livez?last=Emma-Last").headers["x-request-id"]
    eventually(lambda: told.named("GET /livez", lubdub__request_id=last))
    eventually(lambda: told.named("job locate"))
    sent = b"".join(body for _, body in told.taken)
    secret = portal.http.headers["authorization"].removeprefix("Bearer ")
    assert {word for word in (case, secret, "Emma", "EMMA", "127.0.0.1") if word.encode() in sent} == set()
    assert "ab" * 16 not in {span.trace for span in told.spans()}
    assert {name for span in told.spans() for name in span.attributes} == ALLOWED
    assert {name for resource in told.resources() for name in resource if not name.startswith("telemetry.sdk.")} <= {
        "service.name",
        "service.instance.id",
    }


def test_a_collector_that_is_away_keeps_nobody_from_work_or_from_stopping(tmp_path: Path) -> None:
    away = f"http://127.0.0.1:{free_port()}"
    service = Service(Settings(data_dir=tmp_path / "data", port=free_port(), otlp_url=away))
    try:
        web, worker = service.start_web(), service.start_worker()
        service.portal().examined(b"quick")
        for process in (web, worker):
            process.terminate()
        assert web.wait(60) in (0, -15)
        assert worker.wait(60) == 0
        assert "Traceback" not in service.log.read_text()
    finally:
        service.stop()


@pytest.mark.parametrize("program", [WEB, WORKER], ids=["web", "worker"])
def test_missing_packages_are_said_in_one_sentence_with_the_command(program: str, tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path / "data", port=free_port(), otlp_url="http://127.0.0.1:4318")
    ended = run(WITHOUT_PACKAGES + program, settings.to_environment())
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith("LUBDUB_OTLP_URL asks for traces")
    assert INSTALL in ended.stderr
    assert "Traceback" not in ended.stderr
    assert (ROOT / INSTALL.split()[-1]).is_file()


def test_without_a_collector_nothing_of_it_is_loaded() -> None:
    assert run(OFF, {}).stdout.strip() == "[]"


@pytest.mark.parametrize("address", ["collector:4318", "ftp://collector", "http://", "http://[", "http://c/?key=1"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(ValidationError, match="LUBDUB_OTLP_URL must be an address"):
        Settings(otlp_url=address)


def run(program: str, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    whole = os.environ | {"PYTHONPATH": str(ROOT / "backend")} | environment
    return subprocess.run([sys.executable, "-c", program], env=whole, capture_output=True, text=True, timeout=120)
