"""Who is told of which case: one look at the database serves all of them."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import Generic, TypeVar

from lubdub.cases.tidings import Standing

Seen = TypeVar("Seen")


class LastSeen(Generic[Seen]):
    """How the cases that somebody listens to stood at the last look."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._listeners: Counter[str] = Counter()
        self._seen: dict[str, Seen | None] = {}

    @contextmanager
    def listening(self, case_id: str, seen: Seen | None) -> Iterator[Callable[[], Seen | None]]:
        """While it lasts the case is among those to look at. Gives how it stood at the last look; None once deleted.

        seen: how it stands now.
        """
        with self._lock:
            self._listeners[case_id] += 1
            self._seen.setdefault(case_id, seen)
        try:
            yield lambda: self._seen.get(case_id)
        finally:
            with self._lock:
                self._listeners[case_id] -= 1
                if self._listeners[case_id] <= 0:
                    del self._listeners[case_id]
                    self._seen.pop(case_id, None)

    def listened(self) -> set[str]:
        """The cases to look at."""
        with self._lock:
            return set(self._listeners)

    def keep(self, looked_at: Collection[str], found: Mapping[str, Seen]) -> None:
        """What a look at these cases found; a deleted one is missing."""
        with self._lock:
            self._seen.update({case_id: found.get(case_id) for case_id in looked_at if case_id in self._listeners})


class Listeners:
    """Whoever is told of each event of a case."""

    def __init__(self, look: Callable[[Collection[str]], Mapping[str, Standing]]) -> None:
        """look: case ids -> how far they have come; a deleted case is missing."""
        self._look = look
        self._last_seen: LastSeen[Standing] = LastSeen()

    @contextmanager
    def listening(self, case_id: str, owner: str | None) -> Iterator[Callable[[int], bool]]:
        """While it lasts the case is looked at. Gives: whether there is news for somebody told up to an event's number.

        Deleted, or somebody else's since one asked last, is news as well. owner: whose it is now.
        """
        with self._last_seen.listening(case_id, Standing(owner, 0)) as last_seen:

            def has_news(told: int) -> bool:
                nonlocal owner
                seen = last_seen()
                if seen is None:
                    return True
                is_others = seen.owner != owner
                owner = seen.owner
                return seen.last_event > told or is_others

            yield has_news

    def look_again(self) -> None:
        """Look once at every case that somebody listens to. Off the event loop only."""
        listened = self._last_seen.listened()
        self._last_seen.keep(listened, self._look(listened))
