"""Spans on their way to a collector, by OpenTelemetry's own library. Imported only when traces are wanted."""

from __future__ import annotations

import threading
from contextvars import ContextVar

from opentelemetry.context import Context
from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import SERVICE_NAME, Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from opentelemetry.sdk.trace.id_generator import RandomIdGenerator
from opentelemetry.trace import (
    NonRecordingSpan,
    SpanContext,
    SpanKind,
    Status,
    StatusCode,
    TraceFlags,
    set_span_in_context,
)

from lubdub.jobs.tracing import ALLOWED, Span

EXPORT_S = 5.0
"""One try to reach the collector, with its repetitions."""
CLOSE_S = 2.0
"""A collector that is away must not keep a process from stopping."""

_call: ContextVar[str] = ContextVar("_call", default="")


class _IdsOfCalls(RandomIdGenerator):
    """A call's request id, 16 hex digits, is its span's id and, after 16 zeros, its trace's; others are random."""

    def generate_span_id(self) -> int:
        return int(_call.get(), 16) if _call.get() else super().generate_span_id()

    def generate_trace_id(self) -> int:
        return int(_call.get(), 16) if _call.get() else super().generate_trace_id()


class OtlpSender:
    """Sends in the background, in bundles; what a collector does not take in time is dropped, and a line is logged."""

    def __init__(self, url: str, service: str) -> None:
        """For the collector at url, under the service's name."""
        exporter = OTLPSpanExporter(endpoint=f"{url.rstrip('/')}/v1/traces", timeout=EXPORT_S)
        self._provider = TracerProvider(
            resource=Resource.create({SERVICE_NAME: service}), id_generator=_IdsOfCalls(), shutdown_on_exit=False
        )
        self._provider.add_span_processor(BatchSpanProcessor(exporter))
        self._tracer = self._provider.get_tracer("lubdub")

    def send(self, span: Span) -> None:
        """Have the span sent some time soon; never waits."""
        is_call = span.kind == "call"
        token = _call.set(span.request_id if is_call else "")
        try:
            sent = self._tracer.start_span(
                span.name,
                context=Context() if is_call else _below_call(span.request_id),
                kind=SpanKind.SERVER if is_call else SpanKind.CONSUMER,
                attributes={name: value for name, value in span.told.items() if name in ALLOWED},
                start_time=span.began_ns,
            )
        finally:
            _call.reset(token)
        for name, moment in span.moments.items():
            sent.add_event(name, timestamp=moment)
        if span.is_fault:
            sent.set_status(Status(StatusCode.ERROR))
        sent.end(span.ended_ns)

    def close(self) -> None:
        """Send what is left, within a few seconds."""
        closing = threading.Thread(target=self._provider.shutdown, daemon=True, name="close-traces")
        closing.start()
        closing.join(CLOSE_S)


def _below_call(request_id: str) -> Context:
    """Where the span of a job belongs that the call asked for; at the top when nobody called."""
    if not request_id:
        return Context()
    number = int(request_id, 16)
    call = SpanContext(number, number, is_remote=True, trace_flags=TraceFlags(TraceFlags.SAMPLED))
    return set_span_in_context(NonRecordingSpan(call), Context())
