"""Opening the database: SQLite in WAL mode by default, PostgreSQL by URL, brought up to date at start."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy.orm import Session

MIGRATIONS = Path(__file__).parent / "migrations"
BUSY_TIMEOUT_MS = 10_000
"""A writer waits this long for another; every write here takes milliseconds."""
LOCK_MIGRATE, LOCK_AUDIT = 0x6C756201, 0x6C756202
"""PostgreSQL advisory locks: one process migrates at a time, one transaction at a time extends the audit chain."""


class DatabaseTooNew(Exception):
    """A newer program has upgraded the database: this one would not know what it means."""


class Database:
    """Connections to the cases' database. `reading` for looking, `writing` for one transaction that changes."""

    def __init__(self, url: str, revision: str = "head") -> None:
        """Connect, and create or upgrade the tables, to an older revision only for a restore.

        Raises sqlalchemy.exc.OperationalError when unreachable, DatabaseTooNew.
        """
        self.info: dict[str, Any] = {}
        """What sessions carry along: `keys`, the key chain, once a vault stands on this database."""
        parsed = sa.make_url(url)
        self.is_sqlite = parsed.get_backend_name() == "sqlite"
        if parsed.drivername == "postgresql":
            parsed = parsed.set(drivername="postgresql+psycopg")
        if self.is_sqlite and parsed.database:
            Path(parsed.database).parent.mkdir(parents=True, exist_ok=True)
        self.engine = sa.create_engine(parsed, pool_pre_ping=not self.is_sqlite, hide_parameters=True)
        if self.is_sqlite:
            sa.event.listen(self.engine, "connect", _set_pragmas)
            sa.event.listen(self.engine, "begin", _begin)
        self._writer = self.engine.execution_options(lubdub_writes=True)
        self.upgrade(revision)

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session that only looks."""
        with Session(self.engine, info=self.info) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A session whose changes are committed together at the end, or not at all.

        Writers queue from their first statement: SQLite by BEGIN IMMEDIATE (a read-then-write upgrade would
        fail at once), PostgreSQL by row locks and the audit chain's lock.
        """
        with Session(self._writer, expire_on_commit=False, info=self.info) as session, session.begin():
            yield session

    @contextmanager
    def snapshot(self) -> Iterator[sa.Connection]:
        """A connection that sees everything as it is at one moment, however long it looks."""
        engine = self.engine if self.is_sqlite else self.engine.execution_options(isolation_level="REPEATABLE READ")
        with engine.connect() as connection, connection.begin():
            yield connection

    def revision(self, connection: sa.Connection) -> str | None:
        """Of the tables; None when there are none yet."""
        return MigrationContext.configure(connection).get_current_revision()

    def ask(self) -> None:
        """Ask the database anything. Raises sqlalchemy.exc.OperationalError when it does not answer."""
        with self.engine.connect() as connection:
            connection.execute(sa.select(1))

    def lock_audit(self, session: Session) -> None:
        """Hold the end of the audit chain until this transaction is over. SQLite's writer holds it already."""
        if not self.is_sqlite:
            session.execute(sa.select(sa.func.pg_advisory_xact_lock(LOCK_AUDIT)))

    def forget_traces(self) -> None:
        """Empty SQLite's write-ahead log, in which deleted keys could still be read."""
        if self.is_sqlite:
            with self.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")

    def close(self) -> None:
        """Give the connections back."""
        self.engine.dispose()

    def upgrade(self, revision: str = "head") -> None:
        """Bring the tables to a revision, in one transaction. Raises DatabaseTooNew."""
        config = Config()
        config.set_main_option("script_location", str(MIGRATIONS))
        known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
        with self._migrating() as connection:
            current = MigrationContext.configure(connection).get_current_revision()
            for one in (current, revision):
                if one not in (None, "head", *known):
                    raise DatabaseTooNew(one)
            config.attributes["connection"] = connection
            command.upgrade(config, revision)

    @contextmanager
    def _migrating(self) -> Iterator[sa.Connection]:
        """The one process that changes the tables now, in one transaction.

        SQLite changes a table by making it anew, which others that refer to it must not hinder: foreign keys are
        checked at the end instead.
        """
        with self._writer.connect() as connection:
            if not self.is_sqlite:
                with connection.begin():
                    connection.execute(sa.select(sa.func.pg_advisory_xact_lock(LOCK_MIGRATE)))
                    yield connection
                return
            raw = connection.connection.driver_connection
            assert raw is not None  # nosec B101
            raw.execute("PRAGMA foreign_keys = OFF")
            try:
                with connection.begin():
                    yield connection
                    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
                    if broken is not None:
                        raise sa.exc.IntegrityError(f"upgrade: rows of {broken[0]} point nowhere", None, Exception())
            finally:
                raw.execute("PRAGMA foreign_keys = ON")


def _set_pragmas(connection: Any, record: object) -> None:
    connection.isolation_level = None  # transactions are begun by _begin alone
    for pragma in (
        f"busy_timeout = {BUSY_TIMEOUT_MS}",
        "journal_mode = WAL",
        "synchronous = FULL",
        "foreign_keys = ON",
        "secure_delete = ON",
    ):
        connection.execute(f"PRAGMA {pragma}")


def _begin(connection: sa.Connection) -> None:
    writes = connection.get_execution_options().get("lubdub_writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")
