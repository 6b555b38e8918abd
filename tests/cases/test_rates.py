"""Budgets counted by several processes at once, on every kind of database there is."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy.exc import SQLAlchemyError

from lubdub.cases.rates import Budget, CarefulRates, LocalRates, Rates, SharedRates, Taken, open_rates
from tests.databases import fresh_database, kinds

HOUR = 3600.0


@pytest.fixture(params=kinds())
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    with fresh_database(request.param, tmp_path) as url:
        yield url


@pytest.fixture
def pair(url: str) -> Iterator[tuple[SharedRates, SharedRates]]:
    pair = SharedRates(url), SharedRates(url)
    yield pair
    for one in pair:
        one.close()


def test_two_processes_count_as_one(pair: tuple[SharedRates, SharedRates]) -> None:
    budget = Budget("a", 4, HOUR)
    left = [pair[number % 2].take([budget]).left for number in range(4)]
    assert left == pytest.approx([3, 2, 1, 0], abs=0.01)
    refused = pair[0].take([budget])
    assert refused.left == pytest.approx(0, abs=0.01)
    assert refused.wait_s == pytest.approx(HOUR / 4, abs=20)
    assert pair[1].take([Budget("b", 4, HOUR)]).wait_s == 0


def test_many_at_once_get_no_more_than_there_is(pair: tuple[SharedRates, SharedRates]) -> None:
    budgets = [Budget("family", 20, HOUR), Budget("address", 1000, HOUR)]
    allowed: list[bool] = []

    def take(rates: SharedRates) -> None:
        allowed.extend(rates.take(budgets).wait_s == 0 for _ in range(10))

    threads = [threading.Thread(target=take, args=(pair[number % 2],)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(allowed) == 60
    assert sum(allowed) == 20


def test_what_was_refused_costs_nothing(pair: tuple[SharedRates, SharedRates]) -> None:
    budget = Budget("a", 10, HOUR)
    assert pair[0].take([budget], 8).left == pytest.approx(2, abs=0.01)
    assert pair[1].take([budget], 5).wait_s > 0
    assert pair[1].take([budget], 2).wait_s == 0


def test_more_than_the_whole_budget_is_never_given(pair: tuple[SharedRates, SharedRates]) -> None:
    refused = pair[0].take([Budget("a", 10, HOUR)], 11)
    assert (refused.left, refused.wait_s) == (pytest.approx(10), HOUR)
    assert pair[0].take([Budget("a", 10, HOUR)], 10).wait_s == 0


def test_the_table_holds_neither_tokens_nor_addresses(pair: tuple[SharedRates, SharedRates], url: str) -> None:
    budget = Budget("caller lubdub_secret", 10, HOUR)
    pair[0].take([budget])
    assert "secret" not in budget.bucket
    assert len(budget.bucket) == 64


def test_full_buckets_are_forgotten(pair: tuple[SharedRates, SharedRates], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lubdub.cases.rates.FORGET_EVERY", 2)
    quick = Budget("quick", 1, 0.001)
    for _ in range(2):
        pair[0].take([quick])
    pair[0].take([quick, Budget("slow", 1, HOUR)])
    pair[0].take([Budget("slow", 5, HOUR)])
    with pair[0]._engine.connect() as connection:
        assert connection.exec_driver_sql("SELECT count(*) FROM rate_buckets").scalar() == 1


def test_a_bucket_fills_steadily_again() -> None:
    moment = 1000.0
    rates = LocalRates(lambda: moment)
    budget = Budget("a", 2, 60.0)
    assert [rates.take([budget]) for _ in range(2)] == [Taken(1.0), Taken(0.0)]
    assert rates.take([budget]) == Taken(0.0, pytest.approx(30.0))
    assert rates.take([Budget("b", 2, 60.0)]) == Taken(1.0)
    moment += 30.0
    assert rates.take([budget]) == Taken(0.0)


def test_the_answer_is_about_the_budget_that_refuses() -> None:
    rates = LocalRates(lambda: 0.0)
    narrow, wide = Budget("narrow", 1, 60.0), Budget("wide", 100, 60.0)
    assert rates.take([wide, narrow]).left == 99
    assert rates.take([wide, narrow]).wait_s == pytest.approx(60.0)


class Away(SharedRates):
    """A database that does not answer."""

    def __init__(self) -> None:
        self.asked = 0

    def take(self, budgets: object, cost: float = 1.0) -> Taken:
        self.asked += 1
        raise SQLAlchemyError


def test_without_the_database_each_process_counts_for_itself_and_asks_again_later() -> None:
    moment, away = 100.0, Away()
    rates: Rates = CarefulRates(away, lambda: moment)
    budget = Budget("a", 2, HOUR)
    assert [rates.take([budget]).wait_s > 0 for _ in range(3)] == [False, False, True]
    assert away.asked == 1
    moment += 6.0
    rates.take([Budget("b", 2, HOUR)])
    assert away.asked == 2


def test_beside_sqlite_counts_have_a_file_of_their_own(tmp_path: Path) -> None:
    rates = open_rates(f"sqlite:///{tmp_path / 'cases.sqlite'}", tmp_path / "data")
    rates.take([Budget("a", 2, HOUR)])
    rates.close()
    assert (tmp_path / "data" / "rates.sqlite").exists()
    assert not (tmp_path / "cases.sqlite").exists()
