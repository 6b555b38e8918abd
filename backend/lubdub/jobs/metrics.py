"""What is counted and measured, for Prometheus. Labels are words out of short lists: no case, person or address."""

from __future__ import annotations

import hmac
import threading
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server

import sqlalchemy as sa
from prometheus_client import Counter, Gauge, Histogram, make_wsgi_app
from prometheus_client.core import REGISTRY, GaugeMetricFamily
from prometheus_client.exposition import ThreadingWSGIServer
from prometheus_client.registry import Collector

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.work import WorkDesk
from lubdub.settings import Settings

QUICK = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0)
SLOW = (0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0)

REQUESTS = Counter("lubdub_http_requests", "Calls answered.", ["method", "route", "status"])
REQUEST_SECONDS = Histogram("lubdub_http_request_seconds", "Time to the end of the answer.", ["route"], buckets=QUICK)
SOCKETS = Gauge("lubdub_sockets_open", "Sockets of live views.")
STREAMS = Gauge("lubdub_event_streams_open", "Pages and programs that listen to events.")
VIEWS = Gauge("lubdub_views_open", "Live views of this process.", ["kind"])
UPLOAD_BYTES = Counter("lubdub_upload_bytes", "Bytes of scans that came in.")
REFUSED = Counter("lubdub_refused_calls", "Calls refused before they were looked at.", ["why"])
TOLD = Counter("lubdub_problems", "Callers who were told that something cannot be, by its kind.", ["kind"])
FAULTS = Counter("lubdub_faults", "Errors of ours, by where they came from.", ["where"])
READY = Gauge("lubdub_ready", "1 when the check of /readyz passed.", ["check"])

JOBS = Counter("lubdub_jobs", "Jobs that ended, by what came of them.", ["kind", "outcome"])
JOB_SECONDS = Histogram("lubdub_job_seconds", "Time of a job in its worker.", ["kind"], buckets=SLOW)
STAGE_SECONDS = Histogram("lubdub_job_stage_seconds", "Time of one stage of a job.", ["stage"], buckets=SLOW)
VERDICTS = Counter("lubdub_verdicts", "Results, by whether they may be shown.", ["verdict"])
CHILD_ENDS = Counter("lubdub_child_ends", "Sandboxed children, by how they ended.", ["how"])
WEBHOOK_TRIES = Counter("lubdub_webhook_tries", "Messages tried, by how it went.", ["outcome"])


def count_fault(error: BaseException) -> None:
    """Count an error of ours under the part of the house it came from, wherever in its chain that stands."""
    modules = {type(one).__module__.partition(".")[0] for one in _chain(error)}
    if "obstore" in modules:
        FAULTS.labels("store").inc()
    elif not modules & {"sqlalchemy", "psycopg", "sqlite3"}:  # counted by `watch_database`
        FAULTS.labels("own").inc()


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


class Waiting(Collector):
    """Asked at each scrape: what waits, for how long. The answers are the same in every process."""

    def __init__(self, desk: WorkDesk, clock: Callable[[], datetime] = now) -> None:
        """Over the open case store."""
        self._desk = desk
        self._clock = clock

    def collect(self) -> Iterable[GaugeMetricFamily]:
        """Nothing while the database is away: a number of before would be wrong."""
        count = GaugeMetricFamily("lubdub_waiting", "What waits for a worker or courier.", labels=["what"])
        age = GaugeMetricFamily("lubdub_waiting_oldest_seconds", "How long the oldest waits.", labels=["what"])
        try:
            waiting = self._desk.whats_waiting()
        except sa.exc.SQLAlchemyError:
            return  # counted by `watch_database`
        for what, number, since in waiting:
            count.add_metric([what], number)
            age.add_metric([what], 0.0 if since is None else max(0.0, (self._clock() - since).total_seconds()))
        yield from (count, age)


class Quiet(WSGIRequestHandler):
    """A scrape every few seconds is worth no line in the log."""

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def serve_metrics(settings: Settings, desk: WorkDesk | None = None) -> Callable[[], None]:
    """Serve this process's numbers on a port of their own, which no proxy leads to; returns what ends it.

    Only on this machine, or to whoever shows the bearer token.
    """
    if not settings.metrics_port:
        return lambda: None
    waiting = None if desk is None else Waiting(desk)
    if waiting is not None:
        REGISTRY.register(waiting)
    app = guarded(settings.metrics_token.get_secret_value())
    server = _server(settings, app)
    threading.Thread(target=server.serve_forever, daemon=True, name="metrics").start()

    def end() -> None:
        server.shutdown()
        server.server_close()
        if waiting is not None:
            REGISTRY.unregister(waiting)

    return end


def _server(settings: Settings, app: Callable[[dict[str, Any], Any], Any]) -> WSGIServer:
    host, port = settings.metrics_host, settings.metrics_port
    try:
        return make_server(host, port, app, ThreadingWSGIServer, handler_class=Quiet)
    except OSError as error:
        raise SystemExit(
            f"The numbers for Prometheus cannot be served on {host}, port {port}: {error.strerror}. "
            "Choose another port with LUBDUB_METRICS_PORT, one for each process."
        ) from error


def guarded(token: str) -> Callable[[dict[str, Any], Any], Any]:
    """The numbers as a WSGI application, behind the token if there is one."""
    numbers = make_wsgi_app()

    def answer(environ: dict[str, Any], start: Any) -> Any:
        shown = str(environ.get("HTTP_AUTHORIZATION", ""))
        if environ["PATH_INFO"] != "/metrics":
            start("404 Not Found", [("Content-Type", "text/plain")])
            return [b"The numbers are at /metrics.\n"]
        if token and not hmac.compare_digest(shown.encode(), f"Bearer {token}".encode()):
            start("401 Unauthorized", [("WWW-Authenticate", "Bearer"), ("Content-Type", "text/plain")])
            return [b"Send the token as a bearer token.\n"]
        return numbers(environ, start)

    return answer


def watch_database(database: Database) -> None:
    """Count every error the database answers with."""
    sa.event.listen(database.engine, "handle_error", lambda _context: FAULTS.labels("database").inc())


def described() -> list[tuple[str, str, list[str]]]:
    """Name, meaning and labels of every number, for the operations page."""
    kept: list[Counter | Gauge | Histogram] = [
        *(REQUESTS, REQUEST_SECONDS, SOCKETS, STREAMS, VIEWS, UPLOAD_BYTES, REFUSED, TOLD, FAULTS, READY),
        *(JOBS, JOB_SECONDS, STAGE_SECONDS, VERDICTS, CHILD_ENDS, WEBHOOK_TRIES),
    ]
    ends = {Counter: "_total", Histogram: "_bucket"}
    told = [(f"{one._name}{ends.get(type(one), '')}", one._documentation, list(one._labelnames)) for one in kept]
    return [
        *told,
        ("lubdub_waiting", "What waits for a worker or courier.", ["what"]),
        ("lubdub_waiting_oldest_seconds", "How long the oldest waits.", ["what"]),
    ]
