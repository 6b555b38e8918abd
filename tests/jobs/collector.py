"""An OpenTelemetry collector for tests: it takes OTLP over HTTP on this machine and keeps what came."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest


@dataclass(frozen=True)
class Seen:
    """One span as it arrived."""

    service: str
    name: str
    trace: str
    id: str
    parent: str
    attributes: dict[str, Any]
    events: list[str]
    is_fault: bool


@dataclass
class Collector:
    """What came in: paths and bodies."""

    url: str = ""
    taken: list[tuple[str, bytes]] = field(default_factory=list)

    def spans(self) -> list[Seen]:
        return [span for _, body in list(self.taken) for span in _spans(body)]

    def resources(self) -> list[dict[str, Any]]:
        bodies = [ExportTraceServiceRequest.FromString(body) for _, body in list(self.taken)]
        return [_plain(group.resource.attributes) for body in bodies for group in body.resource_spans]

    def named(self, name: str, **attributes: Any) -> list[Seen]:
        told = {key.replace("__", "."): value for key, value in attributes.items()}
        return [span for span in self.spans() if span.name == name and told.items() <= span.attributes.items()]


def _spans(body: bytes) -> Iterator[Seen]:
    for group in ExportTraceServiceRequest.FromString(body).resource_spans:
        service = _plain(group.resource.attributes)["service.name"]
        for span in (span for scope in group.scope_spans for span in scope.spans):
            assert 0 < span.start_time_unix_nano <= span.end_time_unix_nano
            yield Seen(
                service,
                span.name,
                span.trace_id.hex(),
                span.span_id.hex(),
                span.parent_span_id.hex(),
                _plain(span.attributes),
                [event.name for event in span.events],
                span.status.code == span.status.STATUS_CODE_ERROR,
            )


def _plain(attributes: Any) -> dict[str, Any]:
    return {one.key: getattr(one.value, one.value.WhichOneof("value")) for one in attributes}


@contextmanager
def collector() -> Iterator[Collector]:
    """A collector that listens on this machine until the end."""
    kept = Collector()

    class Taking(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            kept.taken.append((self.path, self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(200)
            self.send_header("Content-Type", "application/x-protobuf")
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Nothing on the terminal."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Taking)
    kept.url = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield kept
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
