"""Counts tries at what can be guessed, in the database, so that a restart or a second process forgets none."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from datetime import timedelta

import sqlalchemy as sa

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import TooManyTries
from lubdub.cases.models_desk import AttemptRow


@dataclass(frozen=True)
class Limit:
    """At most so many tries in so long a time."""

    tries: int
    within: timedelta


LONGEST = timedelta(days=1)
"""No limit counts longer than this; older counts are dropped."""


class Attempts:
    """Tries at passwords, codes and dates of birth."""

    def __init__(self, database: Database) -> None:
        """Over an open database."""
        self._database = database

    def count(self, subject: str, limit: Limit) -> None:
        """One more try. Raises TooManyTries when there were too many before it."""
        moment = now()
        with self._database.writing() as session:
            key = hashlib.sha256(subject.encode()).hexdigest()
            row = session.get(AttemptRow, key, with_for_update=True)
            if row is None or row.since < moment - limit.within:
                session.merge(AttemptRow(subject_sha256=key, count=1, since=moment))
                return
            if row.count >= limit.tries:
                left = row.since + limit.within - moment
                raise TooManyTries(max(1, math.ceil(left.total_seconds())))
            row.count += 1

    def forget(self, subject: str) -> None:
        """It went well: the tries before do not count any more."""
        with self._database.writing() as session:
            key = hashlib.sha256(subject.encode()).hexdigest()
            session.execute(sa.delete(AttemptRow).where(AttemptRow.subject_sha256 == key))
