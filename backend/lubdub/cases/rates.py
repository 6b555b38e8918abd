"""How much somebody may do in how long a time, counted for all processes together.

A bucket is one number: the moment at which it will be full again. Taking moves it into the future; what would move it
further than the whole period is refused. So one statement of SQL counts for any number of web processes, and a row
whose moment has passed says nothing and may go.
"""

from __future__ import annotations

import hashlib
import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import SQLAlchemyError

FORGET_EVERY = 1000
"""Takings between two clean-ups of buckets that are full again."""
LOCK_TABLE = 0x6C756203
REST_S = 5.0
"""How long a database that did not answer is left alone."""
REMEMBERED = 20_000
"""Buckets one process counts by itself."""

TABLE = sa.Table(
    "rate_buckets",
    sa.MetaData(),
    sa.Column("bucket", sa.String(64), primary_key=True),
    sa.Column("full_at", sa.Double, nullable=False),
)

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Budget:
    """At most so much in so long a time, given back steadily. subject: whose; only its hash is kept."""

    subject: str
    capacity: float
    period_s: float

    @property
    def bucket(self) -> str:
        """What it is counted under."""
        return hashlib.sha256(self.subject.encode()).hexdigest()

    def seconds(self, cost: float) -> float:
        """How much later the bucket is full again."""
        return cost * self.period_s / self.capacity


@dataclass(frozen=True)
class Taken:
    """left: how much of the budget remains; wait_s: when it was refused, until it would not be."""

    left: float
    wait_s: float = 0.0


class Rates(Protocol):
    """Where takings are counted."""

    def take(self, budgets: Sequence[Budget], cost: float = 1.0) -> Taken:
        """Take from every budget. The answer tells of the first one that refuses, else of the first one."""


class LocalRates:
    """Counted in this process alone."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        """Empty: every bucket is full."""
        self._clock = clock
        self._full_at: OrderedDict[str, float] = OrderedDict()
        self._lock = threading.Lock()

    def take(self, budgets: Sequence[Budget], cost: float = 1.0) -> Taken:
        """As the protocol says."""
        moment = self._clock()
        with self._lock:
            answers = [self._take(budget, cost, moment) for budget in budgets]
        return _whole(answers)

    def _take(self, budget: Budget, cost: float, moment: float) -> Taken:
        before = max(self._full_at.pop(budget.bucket, 0.0), moment)
        after = before + budget.seconds(cost)
        self._full_at[budget.bucket] = after if after - moment <= budget.period_s else before
        if len(self._full_at) > REMEMBERED:
            self._full_at.popitem(last=False)
        return _answer(budget, cost, before - moment, after - moment)


class SharedRates:
    """Counted in a table that all processes share. Connects, and makes the table, when it is first used."""

    def __init__(self, url: str) -> None:
        """url: of SQLAlchemy; for SQLite a file of its own, for PostgreSQL the cases' database."""
        parsed = sa.make_url(url)
        self._is_sqlite = parsed.get_backend_name() == "sqlite"
        if self._is_sqlite:
            Path(parsed.database or "").parent.mkdir(parents=True, exist_ok=True)
            self._engine = sa.create_engine(parsed, isolation_level="AUTOCOMMIT")
            sa.event.listen(self._engine, "connect", _set_pragmas)
        else:
            self._engine = sa.create_engine(
                parsed.set(drivername="postgresql+psycopg"),
                isolation_level="AUTOCOMMIT",
                pool_pre_ping=True,
                pool_timeout=2,
                connect_args={"connect_timeout": 2, "options": "-c statement_timeout=2000"},
                hide_parameters=True,
            )
        self._counting, self._asking = _statements(self._is_sqlite)
        self._is_made = False
        self._taken = 0
        self._lock = threading.Lock()

    def take(self, budgets: Sequence[Budget], cost: float = 1.0) -> Taken:
        """As the protocol says. Raises sqlalchemy.exc.SQLAlchemyError when the database does not answer."""
        self._make()
        # Always in the same order, so that two processes never wait for each other's rows.
        answers = {}
        with self._engine.connect() as connection:
            for budget in sorted(budgets, key=lambda budget: budget.bucket):
                answers[budget.bucket] = self._take(connection, budget, cost)
            self._forget(connection)
        return _whole([answers[budget.bucket] for budget in budgets])

    def close(self) -> None:
        """Give the connections back."""
        self._engine.dispose()

    def _take(self, connection: sa.Connection, budget: Budget, cost: float) -> Taken:
        added = budget.seconds(cost)
        if added > budget.period_s:
            return _answer(budget, cost, 0.0, added)
        told = {"bucket": budget.bucket, "added": added, "period": budget.period_s, "moment": time.time()}
        ahead = connection.scalar(self._counting, told)
        if ahead is not None:
            return _answer(budget, cost, ahead - added, ahead)
        until_full = connection.scalar(self._asking, told) or 0.0
        return _answer(budget, cost, until_full, until_full + added)

    def _make(self) -> None:
        with self._lock:
            if self._is_made:
                return
            with self._engine.connect() as connection:
                if self._is_sqlite:
                    connection.execute(sa.schema.CreateTable(TABLE, if_not_exists=True))
                else:
                    _make_unlogged(connection)
            self._is_made = True

    def _forget(self, connection: sa.Connection) -> None:
        self._taken += 1
        if self._taken % FORGET_EVERY == 0:
            connection.execute(sa.delete(TABLE).where(_now(self._is_sqlite) > TABLE.c.full_at), {"moment": time.time()})


class CarefulRates:
    """Counted here first and then for all. What is refused here costs no other process anything.

    While the shared table does not answer, each process counts for itself.
    """

    def __init__(self, shared: SharedRates, clock: Callable[[], float] = time.monotonic) -> None:
        """Over the shared table."""
        self._here = LocalRates()
        self._shared = shared
        self._clock = clock
        self._asked_again_at = 0.0

    def take(self, budgets: Sequence[Budget], cost: float = 1.0) -> Taken:
        """As the protocol says."""
        here = self._here.take(budgets, cost)
        if here.wait_s > 0 or self._clock() < self._asked_again_at:
            return here
        try:
            return self._shared.take(budgets, cost)
        except SQLAlchemyError as error:
            self._asked_again_at = self._clock() + REST_S
            log.warning("calls are counted in this process alone for a while: %s", type(error).__name__)
            return here

    def close(self) -> None:
        """Give the connections back."""
        self._shared.close()


def open_rates(database_url: str, data_dir: Path) -> CarefulRates:
    """With PostgreSQL the table lies in it; else in a file of its own, so that counting never waits for a case."""
    if sa.make_url(database_url).get_backend_name() != "sqlite":
        return CarefulRates(SharedRates(database_url))
    return CarefulRates(SharedRates(f"sqlite:///{data_dir.resolve() / 'rates.sqlite'}"))


def _whole(answers: Sequence[Taken]) -> Taken:
    return next((answer for answer in answers if answer.wait_s > 0), answers[0])


def _answer(budget: Budget, cost: float, before_s: float, after_s: float) -> Taken:
    """before_s, after_s: seconds until the bucket is full, without this taking and with it."""
    each = budget.period_s / budget.capacity
    if after_s <= budget.period_s:
        return Taken((budget.period_s - after_s) / each)
    if budget.seconds(cost) > budget.period_s:
        return Taken((budget.period_s - before_s) / each, budget.period_s)
    return Taken(max(0.0, (budget.period_s - before_s) / each), after_s - budget.period_s)


def _statements(is_sqlite: bool) -> tuple[sa.Executable, sa.Executable]:
    """One that takes from a bucket and tells how far ahead it is then, nothing when it refuses; one that only tells.

    Written once: to put them together at every call took longer than to ask them.
    """
    dialect: Any = sqlite if is_sqlite else postgresql
    moment = _now(is_sqlite)
    added, period = sa.bindparam("added", type_=sa.Double), sa.bindparam("period", type_=sa.Double)
    before = sa.case((TABLE.c.full_at > moment, TABLE.c.full_at), else_=moment)
    counting = (
        dialect.insert(TABLE)
        .values(bucket=sa.bindparam("bucket"), full_at=moment + added)
        .on_conflict_do_update(
            index_elements=[TABLE.c.bucket],
            set_={"full_at": before + added},
            where=before + added - moment <= period,
        )
        .returning(TABLE.c.full_at - moment)
    )
    return counting, sa.select(before - moment).where(TABLE.c.bucket == sa.bindparam("bucket"))


def _now(is_sqlite: bool) -> sa.ColumnElement[float]:
    """PostgreSQL's own clock, which all machines share; SQLite's processes share the machine's."""
    if is_sqlite:
        return sa.bindparam("moment", type_=sa.Double)
    return sa.cast(sa.extract("epoch", sa.func.statement_timestamp()), sa.Double)


def _make_unlogged(connection: sa.Connection) -> None:
    """Without a log on disk: counting is quick, and what a crash of the database loses are minutes of counts."""
    connection.execute(sa.select(sa.func.pg_advisory_lock(LOCK_TABLE)))
    try:
        connection.exec_driver_sql(
            "CREATE UNLOGGED TABLE IF NOT EXISTS rate_buckets "
            "(bucket varchar(64) PRIMARY KEY, full_at double precision NOT NULL)"
        )
    finally:
        connection.execute(sa.select(sa.func.pg_advisory_unlock(LOCK_TABLE)))


def _set_pragmas(connection: Any, record: object) -> None:
    # Counts may be lost with the machine's power, so nothing waits for the disk.
    for pragma in ("busy_timeout = 2000", "synchronous = OFF"):
        connection.execute(f"PRAGMA {pragma}")
