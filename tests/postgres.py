"""A PostgreSQL of the tests' own, in a folder of its own, that may be killed and started again.

    with own_postgres() as server:
        with server.database() as url: ...
        server.kill()     # SIGKILL, to the server and all its processes
        server.start()    # recovers, on the same port

Uses the machine's installed programs (Debian's package `postgresql`, which `./lubdub test` installs).
"""

from __future__ import annotations

import contextlib
import functools
import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psycopg
import sqlalchemy as sa

UNPACKED = Path(__file__).parents[1] / ".system"
PATIENCE_S = 90.0
SUPERUSER = "postgres"
UNPRIVILEGED = ("postgres", "nobody")
"""Who runs the server when the tests run as root, whom PostgreSQL refuses."""


@functools.cache
def programs() -> Path | None:
    """The folder of initdb and postgres, the newest there is; None when PostgreSQL's server is not installed."""
    packaged = [*Path("/usr/lib/postgresql").glob("*/bin"), *UNPACKED.glob("usr/lib/postgresql/*/bin")]
    found = [folder for folder in packaged if (folder / "initdb").is_file()]
    if found:
        return max(found, key=lambda folder: int(folder.parent.name))
    elsewhere = shutil.which("initdb")
    return None if elsewhere is None else Path(elsewhere).resolve().parent


@dataclass
class PostgresServer:
    """A server on a loopback port. It trusts whoever connects, and its files are in `folder`."""

    folder: Path
    port: int
    _process: subprocess.Popen[bytes] | None = field(default=None, repr=False)

    @property
    def url(self) -> str:
        """The maintenance database, as SQLAlchemy wants it; superuser."""
        return f"postgresql+psycopg://{SUPERUSER}@127.0.0.1:{self.port}/postgres"

    @property
    def log(self) -> str:
        """What the server said."""
        return (self.folder / "log").read_text(errors="replace")

    def create(self) -> None:
        """Make the cluster's files."""
        words = ["-U", SUPERUSER, "-A", "trust", "-E", "UTF8", "--locale", "C", "--no-sync"]
        _as_server("initdb", "-D", self.folder / "data", *words)

    def start(self, **settings: str) -> None:
        """Start, also after `kill` or `stop`, and wait until it takes connections. settings: as in postgresql.conf."""
        assert self._process is None, "it runs already"
        # The tests kill processes, not the machine: what the kernel was told is safe without waiting for the disk.
        told = {"fsync": "off", "listen_addresses": "127.0.0.1", "unix_socket_directories": "", **settings}
        options = [word for name, value in told.items() for word in ("-c", f"{name}={value}")]
        with (self.folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [_program("postgres"), "-D", self.folder / "data", "-p", str(self.port), *options],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=self.folder,
                start_new_session=True,
                **_unprivileged(),
            )
        deadline = time.monotonic() + PATIENCE_S
        while not self._takes_connections():
            assert self._process.poll() is None, self.log[-3000:]
            assert time.monotonic() < deadline, self.log[-3000:]
            time.sleep(0.05)

    def kill(self) -> None:
        """SIGKILL, as the system does when memory runs out: the server and every process that serves a client."""
        assert self._process is not None, "it does not run"
        family = [self._process.pid, *_children(self._process.pid)]
        for pid in family:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self._process.wait()
        self._process = None
        deadline = time.monotonic() + PATIENCE_S
        while any(_is_alive(pid) for pid in family):
            assert time.monotonic() < deadline, "a process of the server does not end"
            time.sleep(0.02)

    def stop(self) -> None:
        """The orderly end, without waiting for clients; harmless when it does not run."""
        if self._process is None:
            return
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(PATIENCE_S)
            self._process = None
        except subprocess.TimeoutExpired:
            self.kill()

    @contextmanager
    def database(self) -> Iterator[str]:
        """The URL of a new empty database, dropped at the end if the server still runs."""
        name = f"lubdub_test_{secrets.token_hex(6)}"
        self._command(f"CREATE DATABASE {name}")
        try:
            url = sa.make_url(self.url).set(database=name, drivername="postgresql")
            yield url.render_as_string(hide_password=False)
        finally:
            if self._process is not None:
                self._command(f"DROP DATABASE {name} WITH (FORCE)")

    def _command(self, words: str) -> None:
        with psycopg.connect(self._conninfo(), autocommit=True) as connection:
            connection.execute(words.encode())

    def _takes_connections(self) -> bool:
        try:
            psycopg.connect(self._conninfo(), connect_timeout=5).close()
        except psycopg.OperationalError:
            return False
        return True

    def _conninfo(self) -> str:
        return f"host=127.0.0.1 port={self.port} user={SUPERUSER} dbname=postgres"


@contextmanager
def own_postgres(**settings: str) -> Iterator[PostgresServer]:
    """A running server, gone at the end with all its files. settings: as in postgresql.conf."""
    # Not below pytest's own folder, which only the user of the tests may enter.
    folder = Path(tempfile.mkdtemp(prefix="lubdub-postgres-"))
    server = PostgresServer(folder, _free_port())
    try:
        user = _unprivileged().get("user")
        if user is not None:
            shutil.chown(folder, user)
        server.create()
        server.start(**settings)
        yield server
    finally:
        server.stop()
        shutil.rmtree(folder, ignore_errors=True)


def _as_server(program: str, *words: str | Path) -> None:
    done = subprocess.run([_program(program), *words], cwd="/", capture_output=True, text=True, **_unprivileged())
    assert done.returncode == 0, done.stdout + done.stderr


def _program(name: str) -> Path:
    folder = programs()
    assert folder is not None, "PostgreSQL's server is not installed; ./lubdub test installs it"
    return folder / name


def _unprivileged() -> dict[str, Any]:
    """How to start a process that is not root."""
    if sys.platform == "win32" or os.geteuid() != 0:
        return {}
    known = {entry.pw_name for entry in pwd.getpwall()}
    user = next(name for name in UNPRIVILEGED if name in known)
    return {"user": user, "group": pwd.getpwnam(user).pw_gid, "extra_groups": []}


def _children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _is_alive(pid: int) -> bool:
    """Whether a process runs; one that only waits to be reaped does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])
