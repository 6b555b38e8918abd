"""Databases for tests: SQLite always; PostgreSQL that LUBDUB_TEST_POSTGRES names, or a local one, or one of our own."""

from __future__ import annotations

import atexit
import os
import secrets
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path

import sqlalchemy as sa

from tests.postgres import own_postgres, programs

LOCAL_POSTGRES = "postgresql+psycopg://postgres@127.0.0.1:5432/postgres"


@cache
def postgres_url() -> str | None:
    """A running server on which databases may be made, or None."""
    url = os.environ.get("LUBDUB_TEST_POSTGRES", LOCAL_POSTGRES)
    engine = sa.create_engine(url, connect_args={"connect_timeout": 2})
    try:
        engine.connect().close()
    except sa.exc.OperationalError:
        return None
    finally:
        engine.dispose()
    return url


def kinds() -> list[str]:
    """The kinds of database that can be tested here; they stand in the tests' names."""
    return ["sqlite"] if postgres_url() is None and programs() is None else ["sqlite", "postgresql"]


@cache
def _server_url() -> str:
    """A server to test on; our own is started for it when no other one runs, and stops with this process."""
    running = postgres_url()
    if running is not None:
        return running
    until_the_end = ExitStack()
    server = until_the_end.enter_context(own_postgres())
    atexit.register(until_the_end.close)
    return server.url


@contextmanager
def fresh_database(kind: str, folder: Path) -> Iterator[str]:
    """The URL of an empty database, gone at the end."""
    if kind == "sqlite":
        yield f"sqlite:///{folder / 'cases.sqlite'}"
        return
    server = sa.make_url(_server_url())
    name = f"lubdub_test_{secrets.token_hex(6)}"
    engine = sa.create_engine(server, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.exec_driver_sql(f"CREATE DATABASE {name}")
    try:
        yield server.set(database=name, drivername="postgresql").render_as_string(hide_password=False)
    finally:
        with engine.connect() as connection:
            connection.exec_driver_sql(f"DROP DATABASE {name} WITH (FORCE)")
        engine.dispose()
