"""The tests' own PostgreSQL: what it was told survives being killed."""

from __future__ import annotations

import psycopg
import pytest
import sqlalchemy as sa

from tests.postgres import own_postgres, programs

pytestmark = pytest.mark.skipif(programs() is None, reason="PostgreSQL's server is not installed here")


def test_what_was_committed_is_there_after_the_server_was_killed_and_started_again() -> None:
    with own_postgres() as server, server.database() as url:
        database = sa.make_url(url).set(drivername="postgresql").render_as_string()
        with psycopg.connect(database) as connection:
            connection.execute("CREATE TABLE kept AS SELECT 42 AS number")
            connection.commit()
            server.kill()
            with pytest.raises(psycopg.OperationalError):
                connection.execute("SELECT 1")
        with pytest.raises(psycopg.OperationalError):
            psycopg.connect(database)
        server.start()
        with psycopg.connect(database) as connection:
            assert connection.execute("SELECT number FROM kept").fetchone() == (42,)
