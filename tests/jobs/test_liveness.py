"""Locks on workers' names, of both kinds: one holder at a time, free when the holder goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from lubdub.jobs.liveness import NameLocks, claim_name, open_locks
from tests.databases import fresh_database, kinds


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
