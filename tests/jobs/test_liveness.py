"""Locks on workers' names, of both kinds: one holder at a time, free when the holder goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from lubdub.jobs.engine import POLL_S
from lubdub.jobs.liveness import (
    ASK_EVERY_S,
    ASKED,
    IDLE_S,
    LOST_AFTER_S,
    NameLocks,
    PostgresLocks,
    claim_name,
    open_locks,
)
from lubdub.jobs.upkeep import BEAT_S
from tests.databases import fresh_database, kinds
from tests.postgres import own_postgres, programs


@pytest.fixture(params=kinds())
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[NameLocks, NameLocks]]:
    """The locks as two processes see them."""
    with fresh_database(request.param, tmp_path) as url:
        one, other = open_locks(url, tmp_path), open_locks(url, tmp_path)
        yield one, other
        one.close()
        other.close()


def test_a_name_has_one_holder(pair: tuple[NameLocks, NameLocks]) -> None:
    one, other = pair
    assert one.try_take("worker-0")
    assert not other.try_take("worker-0")
    assert not one.try_take("worker-0")
    one.release("worker-0")
    assert other.try_take("worker-0")


def test_a_name_is_free_when_its_holder_is_gone(pair: tuple[NameLocks, NameLocks], tmp_path: Path) -> None:
    one, other = pair
    one.try_take("worker-0")
    one.close()
    assert within_seconds(lambda: other.try_take("worker-0"))


def within_seconds(holds: Callable[[], bool]) -> bool:
    """PostgreSQL hears that a client hung up a moment after it did."""
    for _ in range(100):
        if holds():
            return True
        time.sleep(0.05)
    return False


def test_workers_take_the_first_free_name(pair: tuple[NameLocks, NameLocks]) -> None:
    one, other = pair
    assert claim_name(one) == "worker-0"
    assert claim_name(other) == "worker-1"
    one.release("worker-0")
    assert claim_name(other) == "worker-0"


@pytest.mark.skipif(programs() is None, reason="PostgreSQL's server is not installed here")
def test_a_name_outlives_the_death_of_the_database(tmp_path: Path) -> None:
    with own_postgres() as server, server.database() as url:
        one, other = open_locks(url, tmp_path), open_locks(url, tmp_path)
        one.try_take("worker-0")
        server.kill()
        with pytest.raises(OperationalError):
            one.keeps("worker-0")
        server.start()
        assert one.keeps("worker-0")
        assert other.keeps("worker-1")
        assert not other.try_take("worker-0")
        one.close()
        other.close()


@pytest.mark.skipif(programs() is None, reason="PostgreSQL's server is not installed here")
def test_a_name_that_another_worker_took_meanwhile_is_lost(tmp_path: Path) -> None:
    with own_postgres() as server, server.database() as url:
        one = open_locks(url, tmp_path)
        one.try_take("worker-0")
        server.kill()
        server.start()
        other = open_locks(url, tmp_path)
        assert other.try_take("worker-0")
        assert not one.keeps("worker-0")
        one.close()
        other.close()


def test_a_lost_machine_is_noticed_and_its_jobs_are_taken_over_within_ten_seconds(tmp_path: Path) -> None:
    """The server asks after a silent connection; what it was told is what the bound is made of."""
    assert LOST_AFTER_S + BEAT_S + POLL_S < 10
    if "postgresql" not in kinds():
        pytest.skip("there is no PostgreSQL here")
    with fresh_database("postgresql", tmp_path) as url:
        locks = PostgresLocks(url)
        for name, value in (("idle", IDLE_S), ("interval", ASK_EVERY_S), ("count", ASKED)):
            shown = locks.ask(f"SHOW tcp_keepalives_{name}")
            assert shown == str(value)
        assert locks.ask("SHOW tcp_user_timeout") == str(LOST_AFTER_S * 1000)
        locks.close()
