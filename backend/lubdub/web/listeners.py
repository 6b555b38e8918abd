"""Who is told of which case: one look at the database serves all of them."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager

from lubdub.cases.tidings import Standing


class Listeners:
    """What was last seen of the cases that somebody listens to."""

    def __init__(self, look: Callable[[Collection[str]], Mapping[str, Standing]]) -> None:
        """look: case ids -> how far they have come; a deleted case is missing."""
        self._look = look
        self._lock = threading.Lock()
        self._listened: Counter[str] = Counter()
        self._seen: dict[str, Standing | None] = {}

    @contextmanager
    def listening(self, case_id: str) -> Iterator[Callable[[int], bool]]:
        """While it lasts the case is looked at. Gives: whether there is news for somebody told up to an event's number.

        Deleted, or somebody else's since one asked last, is news as well.
        """
        with self._lock:
            self._listened[case_id] += 1
        owners: list[str | None] = []

        def has_news(told: int) -> bool:
            if case_id not in self._seen:
                return False
            seen = self._seen[case_id]
            if seen is None:
                return True
            is_others = owners not in ([], [seen.owner])
            owners[:] = [seen.owner]
            return seen.last_event > told or is_others

        try:
            yield has_news
        finally:
            with self._lock:
                self._listened[case_id] -= 1
                if self._listened[case_id] <= 0:
                    del self._listened[case_id]
                    self._seen.pop(case_id, None)

    def look_again(self) -> None:
        """Look once at every case that somebody listens to. Off the event loop only."""
        with self._lock:
            listened = set(self._listened)
        found = self._look(listened)
        with self._lock:
            self._seen.update({case_id: found.get(case_id) for case_id in listened & set(self._listened)})
