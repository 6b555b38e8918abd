"""Which workers live: each holds a lock on its name, which the system lets go when the worker dies, however."""

from __future__ import annotations

import fcntl
import hashlib
import os
from pathlib import Path
from typing import Protocol

import sqlalchemy as sa

from lubdub.jobs.engine import jobs_url

MAX_WORKERS = 1000
IDLE_S, ASK_EVERY_S, ASKED = 2, 1, 3
LOST_AFTER_S = IDLE_S + ASK_EVERY_S * ASKED
"""So long after its last word a machine that answers nothing counts as lost."""

_KEEPALIVES = {"keepalives_idle": IDLE_S, "keepalives_interval": ASK_EVERY_S, "keepalives_count": ASKED}
_OUR_SIDE = {"keepalives": 1, "tcp_user_timeout": LOST_AFTER_S * 1000, "connect_timeout": LOST_AFTER_S}
_SERVER_SIDE = " ".join(
    [*(f"-c tcp_{name}={value}" for name, value in _KEEPALIVES.items()), f"-c tcp_user_timeout={LOST_AFTER_S * 1000}"]
)


class NameLocks(Protocol):
    """Locks on workers' names. Held until `release`, `close` or the end of the process."""

    def try_take(self, name: str) -> bool:
        """Take the lock; False when a living process, or this object itself, holds it."""

    def keeps(self, name: str) -> bool:
        """Whether a name taken before is still held. What can be made good is: a lost connection is opened anew."""

    def release(self, name: str) -> None:
        """Let it go."""

    def close(self) -> None:
        """Let all go."""


def claim_name(locks: NameLocks) -> str:
    """The first free of worker-0, worker-1 ...: stable names, so that a restarted worker finds its own jobs."""
    for number in range(MAX_WORKERS):
        if locks.try_take(f"worker-{number}"):
            return f"worker-{number}"
    raise RuntimeError(f"{MAX_WORKERS} workers are running already")


class FileLocks:
    """For workers of one machine that share an SQLite file."""

    def __init__(self, folder: Path) -> None:
        """folder: made when needed."""
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._held: dict[str, int] = {}

    def try_take(self, name: str) -> bool:
        """As the protocol says."""
        if name in self._held:
            return False
        descriptor = os.open(self._folder / f"{name}.lock", os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            return False
        self._held[name] = descriptor
        return True

    def keeps(self, name: str) -> bool:
        """As the protocol says: only the end of the process loses a lock on a file."""
        return name in self._held

    def release(self, name: str) -> None:
        """As the protocol says."""
        os.close(self._held.pop(name))

    def close(self) -> None:
        """As the protocol says."""
        for name in list(self._held):
            self.release(name)


class PostgresLocks:
    """For workers of many machines: session advisory locks of one connection that stays open.

    A process that dies closes its connection at once. A machine that is lost cannot: the server asks after it and
    closes the connection itself when there is no answer, within LOST_AFTER_S.
    """

    def __init__(self, database_url: str) -> None:
        """Connect."""
        self._engine = sa.create_engine(
            jobs_url(database_url),
            isolation_level="AUTOCOMMIT",
            poolclass=sa.NullPool,
            connect_args={**_KEEPALIVES, **_OUR_SIDE, "options": _SERVER_SIDE},
        )
        self._connection = self._engine.connect()
        self._held: set[str] = set()

    def try_take(self, name: str) -> bool:
        """As the protocol says. Raises sqlalchemy.exc.OperationalError when the connection is lost."""
        if name in self._held:
            return False
        taken = bool(self._connection.scalar(sa.select(sa.func.pg_try_advisory_lock(_number(name)))))
        if taken:
            self._held.add(name)
        return taken

    def keeps(self, name: str) -> bool:
        """As the protocol says. Raises sqlalchemy.exc.OperationalError while the server does not answer."""
        if self._connection.closed:
            self._connection = self._engine.connect()
        try:
            self._connection.execute(sa.select(1))
        except sa.exc.DBAPIError:
            self._held.clear()
            self._connection.close()
            self._connection = self._engine.connect()
        return name in self._held or self.try_take(name)

    def ask(self, question: str) -> str:
        """What the server says of this very connection."""
        return str(self._connection.scalar(sa.text(question)))

    def release(self, name: str) -> None:
        """As the protocol says."""
        self._held.remove(name)
        self._connection.execute(sa.select(sa.func.pg_advisory_unlock(_number(name))))

    def close(self) -> None:
        """As the protocol says."""
        self._connection.close()
        self._engine.dispose()


def open_locks(jobs_database_url: str, data_dir: Path) -> NameLocks:
    """The kind of locks that fits the queue's database."""
    if sa.make_url(jobs_database_url).get_backend_name() == "sqlite":
        return FileLocks(data_dir / "workers")
    return PostgresLocks(jobs_database_url)


def _number(name: str) -> int:
    """PostgreSQL's locks are known by signed 64-bit numbers."""
    return int.from_bytes(hashlib.sha256(f"lubdub {name}".encode()).digest()[:8], "big", signed=True)
