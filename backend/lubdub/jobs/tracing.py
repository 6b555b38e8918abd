"""Traces: one span for each call and one for each job, to a collector if there is one. Without one no sender is loaded.

A call's trace is named after its request id, which travels with the job that the call asked for: so the job's span
finds its place below the call's. What strangers say about traces, such as a `traceparent` header, is not listened to.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

from lubdub.settings import Settings

REQUIREMENTS = "requirements-otel.txt"
INSTALL = f".venv/bin/python -m pip install --require-hashes -r {REQUIREMENTS}"

ALLOWED = frozenset(
    {"http.request.method", "http.route", "http.response.status_code", "lubdub.request_id"}
    | {"lubdub.job.kind", "lubdub.job.stage", "lubdub.job.outcome"}
)
"""All that a span may tell beside its name and times. Values are words out of short lists, and the request id."""


@dataclass(frozen=True)
class Span:
    """What is told of one call or job. began_ns, ended_ns and moments: nanoseconds since 1970."""

    name: str
    kind: Literal["call", "job"]
    request_id: str
    began_ns: int
    ended_ns: int
    told: Mapping[str, str | int]
    moments: Mapping[str, int] = field(default_factory=dict)
    is_fault: bool = False


@dataclass
class JobTrace:
    """What is noted of a job while it is done: when each stage began, and what came of it."""

    kind: str
    request_id: str
    outcome: str = "unfinished"
    began_ns: int = field(default_factory=time.time_ns)
    stages: dict[str, int] = field(default_factory=dict)

    def note_stage(self, stage: str) -> None:
        """The stage begins now. Once each: stages are named by the child, which may say them any number of times."""
        self.stages.setdefault(stage, time.time_ns())


class Sender(Protocol):
    """What brings spans to a collector."""

    def send(self, span: Span) -> None:
        """Have the span sent some time soon; never waits."""

    def close(self) -> None:
        """Send what is left, within a few seconds."""


_sender: Sender | None = None


def check_traceable(settings: Settings) -> None:
    """Ends the process with a sentence when traces are wanted and the packages for them are not there."""
    if not settings.otlp_url:
        return
    try:
        import lubdub.jobs.otlp  # noqa: F401
    except ModuleNotFoundError as error:
        raise SystemExit(
            "LUBDUB_OTLP_URL asks for traces, and the packages for OpenTelemetry are not installed. Install them from "
            f"Lubdub's folder with `{INSTALL}`, or leave LUBDUB_OTLP_URL empty."
        ) from error


def start_tracing(settings: Settings, role: str) -> Callable[[], None]:
    """Send spans of this process, which plays role, from now on; returns what ends it. Does nothing when off."""
    global _sender
    if not settings.otlp_url:
        return lambda: None
    from lubdub.jobs.otlp import OtlpSender

    sender = _sender = OtlpSender(settings.otlp_url, f"lubdub-{role}")

    def end() -> None:
        global _sender
        _sender = None
        sender.close()

    return end


def trace_call(request_id: str, method: str, route: str, status: int, began_ns: int) -> None:
    """Tell of a call that was answered. method: a known one; route: with its holes, never what was in them."""
    told: dict[str, str | int] = {
        "http.request.method": method,
        "http.route": route,
        "http.response.status_code": status,
        "lubdub.request_id": request_id,
    }
    _send(Span(f"{method} {route}", "call", request_id, began_ns, time.time_ns(), told, is_fault=status >= 500))


def trace_job(job: JobTrace) -> None:
    """Tell of a job that ended. Its id is kept back: it holds the case's."""
    told: dict[str, str | int] = {
        "lubdub.job.kind": job.kind,
        "lubdub.job.outcome": job.outcome,
        "lubdub.job.stage": next(reversed(job.stages), "none"),
        "lubdub.request_id": job.request_id,
    }
    is_fault = job.outcome in ("failed", "unfinished")
    _send(Span(f"job {job.kind}", "job", job.request_id, job.began_ns, time.time_ns(), told, job.stages, is_fault))


def _send(span: Span) -> None:
    if _sender is not None:
        _sender.send(span)
