"""Keeping the live views of a process in step with the database, which other processes change as well."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Generic, Protocol, TypeVar

from lubdub.jobs.metrics import VIEWS
from lubdub.views.servers import ViewRegistry

FOLLOW_EVERY_S = 0.2
REAP_EVERY_S = 60.0

Content = TypeVar("Content")

log = logging.getLogger(__name__)


class Views(Protocol):
    """Live views that are looked after. Each call may wait for database, store and browsers: off the event loop."""

    def look_again(self) -> None:
        """Bring what is shown up to date."""

    def reap(self) -> None:
        """Stop views nobody looks at."""

    def open_count(self) -> int:
        """How many there are."""

    def close_all(self) -> None:
        """Stop every view."""


class RegisteredViews(Generic[Content]):
    """What all kinds of `Views` share: a registry of those that are open."""

    def __init__(self) -> None:
        """None is open."""
        self._registry: ViewRegistry[Content] = ViewRegistry()

    def open_count(self) -> int:
        """How many views are open."""
        return len(self._registry.ids())

    def close_all(self) -> None:
        """Stop every view. Off the event loop only."""
        self._registry.close_all()

    def reap(self) -> None:
        """Stop views nobody looks at. Off the event loop only."""
        self._registry.reap()


@asynccontextmanager
async def following(views: Views, kind: str) -> AsyncIterator[None]:
    """Look after the views until the end, and then stop them."""
    VIEWS.labels(kind).set_function(views.open_count)
    tasks = [
        asyncio.create_task(again_and_again(views.look_again, FOLLOW_EVERY_S)),
        asyncio.create_task(again_and_again(views.reap, REAP_EVERY_S)),
    ]
    yield
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    await asyncio.to_thread(views.close_all)


async def again_and_again(look: Callable[[], None], every_s: float) -> None:
    """Look, for ever, off the event loop; what fails is tried again the next time."""
    while True:
        await asyncio.sleep(every_s)
        try:
            await asyncio.to_thread(look)
        except Exception as error:  # a database or store that is away comes back, and then it goes on
            log.warning("live views could not be looked after: %s", type(error).__name__)
