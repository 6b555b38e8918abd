"""The product on one machine, by one command: the web server in this process, a worker beside it, watched."""

from __future__ import annotations

import contextlib
import errno
import math
import os
import socket
import subprocess  # nosec B404
import sys
import threading
from collections.abc import Callable

import structlog
import uvicorn
from fastapi import FastAPI

from lubdub.cases.admin import first_link
from lubdub.cases.opening import CannotOpen, open_cases
from lubdub.jobs.engine import UNTIL_INPUT_CLOSES
from lubdub.jobs.logs import configure_logs
from lubdub.jobs.tracing import check_traceable
from lubdub.safety import warnings
from lubdub.settings import Settings
from lubdub.web.app import WebRole, create_app

STOP_S = 5.0
RESTART_S = 2.0
"""A worker that dies at once is started again no faster than this."""

log = structlog.stdlib.get_logger(__name__)


def warn(settings: Settings) -> None:
    """Say what is safe only under circumstances."""
    for words in warnings(settings):
        log.warning("settings: %s", words)


def run_web(settings: Settings, role: WebRole = "web") -> None:
    """Run the web server, or a view server, alone until it is told to stop.

    Ends the process with a sentence when it cannot start.
    """
    configure_logs(settings)
    warn(settings)
    check_traceable(settings)
    listening = listening_socket(settings)
    check_openable(settings)
    _serve(create_app(settings, role), settings, listening)


def serve(settings: Settings) -> None:
    """Run web server and worker until Ctrl-C. Ends the process with a sentence when it cannot start."""
    configure_logs(settings)
    warn(settings)
    check_traceable(settings)
    listening = listening_socket(settings)
    check_openable(settings)
    worker = SupervisedWorker(settings)
    worker.start()
    _say("Lubdub is starting.")
    try:
        _serve(create_app(settings), settings, listening, lambda: _welcome(settings))
    finally:
        worker.stop()


def listening_socket(settings: Settings) -> socket.socket:
    """The socket the server listens on, bound before anything else is started."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listening = socket.socket(family)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((settings.host, settings.port))
    except OSError as error:
        listening.close()
        raise SystemExit(_why_not(settings, error)) from error
    return listening


def _why_not(settings: Settings, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"Port {settings.port} is taken by another program. Stop that one, or choose another port: "
            f"LUBDUB_PORT={settings.port + 1} ./lubdub serve"
        )
    if error.errno == errno.EACCES:
        return f"Port {settings.port} may only be used by the administrator. Choose one above 1023 with LUBDUB_PORT."
    return f"Lubdub cannot listen on {settings.host}, port {settings.port}: {error.strerror}."


def check_openable(settings: Settings) -> None:
    """Ends the process with a sentence when database, files or key cannot be used."""
    try:
        database, _ = open_cases(settings.database, settings.store, settings.master_key_source)
    except CannotOpen as error:
        raise SystemExit(str(error)) from error
    database.close()


def _serve(
    app: FastAPI, settings: Settings, listening: socket.socket, announce: Callable[[], None] = lambda: None
) -> None:
    app.state.announce = announce
    config = uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=settings.behind_tls_proxy,
        forwarded_allow_ips=settings.trusted_proxies,
        timeout_graceful_shutdown=math.ceil(settings.stop_s),
        ws_max_size=1 << 20,
    )
    server = uvicorn.Server(config)
    app.state.is_stopping = lambda: server.should_exit
    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C is how it is stopped
        server.run(sockets=[listening])


def _welcome(settings: Settings) -> None:
    first = first_link(settings.database)
    desk = f"{settings.desk_address}/desk"
    lines = (
        "Lubdub is ready.",
        f"  For a parent:            {settings.address}/",
        f"  For a clinician:         {desk}",
        *([] if first is None else [f"  The first clinician, once, within 24 hours: {desk}/join#{first.token}"]),
        "  For a portal, a key:     ./lubdub admin key create NAME",
        f"  The REST interface:      {settings.address}/api/docs",
        "Ctrl-C stops everything.",
    )
    _say("\n".join(lines))


def _say(words: str) -> None:
    sys.stdout.write(words + "\n")
    sys.stdout.flush()


class SupervisedWorker:
    """A worker process that is started again whenever it dies, until `stop`."""

    def __init__(self, settings: Settings) -> None:
        """For these settings."""
        self._environment = os.environ | settings.to_environment()
        if settings.metrics_port:
            self._environment["LUBDUB_METRICS_PORT"] = str(settings.metrics_port + 1)
        self._environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True, name="worker-supervisor")

    def start(self) -> None:
        """Start the worker and watch it."""
        self._thread.start()

    def stop(self) -> None:
        """End the worker and wait for its end."""
        self._stopping.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._stopping.is_set():
            process = self._spawn()
            while process.poll() is None and not self._stopping.wait(0.2):
                pass
            if not self._stopping.is_set():
                log.warning("the worker died and is started again", status=process.returncode)
                self._stopping.wait(RESTART_S)
            else:
                _end(process)

    def _spawn(self) -> subprocess.Popen[bytes]:
        """Its standard input is a leash: when this process dies, however, it closes, and the worker stops."""
        return subprocess.Popen(  # nosec B603
            [sys.executable, "-m", "lubdub.jobs.worker", UNTIL_INPUT_CLOSES],
            stdin=subprocess.PIPE,
            env=self._environment,
            start_new_session=True,  # Ctrl-C in a terminal is for this process, which then ends the worker
        )


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    finally:
        if process.stdin is not None:
            process.stdin.close()
