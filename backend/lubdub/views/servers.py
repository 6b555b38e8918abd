"""One loopback viser server for each open case; never one shared, never on a public address."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import rich
import viser

Content = TypeVar("Content")

MOST_OPEN = 200
"""Limit is threads and file handles: a server takes one thread at rest and up to 32 at work."""
IDLE_S = 600.0
"""A view nobody looks at for ten minutes is stopped; it is built again from what is stored."""


class ViewsFull(Exception):
    """Too many cases are open at once on this machine."""


LiveServer = viser.ViserServer
"""What a live view is built on, by the name that other rooms may use."""


def start_server() -> viser.ViserServer:
    """A viser server on loopback, on a port the system chose, that cannot be shared.

    The share request would open a public tunnel to a child's body, so it is disarmed here as well as in the proxy.
    """
    rich.get_console().quiet = True  # viser announces each start and stop on standard output
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    server.request_share_url = _no_sharing  # type: ignore[method-assign]
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    return server


def _no_sharing(verbose: bool = True) -> str | None:
    return None


@dataclass
class OpenView(Generic[Content]):
    """A running server and what was built in it."""

    server: viser.ViserServer
    content: Content
    port: int
    windows: Counter[str] = field(default_factory=Counter)
    """The attached windows of browsers, each by the word that its page gave it."""
    last_seen: float = field(default=0.0)

    @property
    def watchers(self) -> int:
        """How many windows are attached."""
        return self.windows.total()


class ViewRegistry(Generic[Content]):
    """The open views by case id. Building and stopping are slow: call both off the event loop."""

    def __init__(
        self, most_open: int = MOST_OPEN, idle_s: float = IDLE_S, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._views: dict[str, OpenView[Content]] = {}
        self._lock = threading.Lock()
        self._most_open = most_open
        self._idle_s = idle_s
        self._clock = clock

    def open(self, case_id: str, build: Callable[[viser.ViserServer], Content]) -> OpenView[Content]:
        """The case's view, started and built if there is none. Raises ViewsFull."""
        with self._lock:
            view = self._views.get(case_id)
            if view is None:
                view = self._start(case_id, build)
            view.last_seen = self._clock()
            return view

    def get(self, case_id: str) -> OpenView[Content] | None:
        """The case's view if it is running."""
        return self._views.get(case_id)

    def ids(self) -> list[str]:
        """Whose views are running."""
        with self._lock:
            return list(self._views)

    def close(self, case_id: str) -> None:
        """Stop a case's view if it is running."""
        with self._lock:
            view = self._views.pop(case_id, None)
        if view is not None:
            view.server.stop()

    async def close_soon(self, case_id: str) -> None:
        """As `close`, from the event loop: a stop waits for browsers whose messages that loop carries."""
        await asyncio.to_thread(self.close, case_id)

    def reap(self) -> list[str]:
        """Stop views without a watcher for too long; returns their case ids."""
        now = self._clock()
        with self._lock:
            idle = [
                case_id
                for case_id, view in self._views.items()
                if view.watchers == 0 and now - view.last_seen > self._idle_s
            ]
        for case_id in idle:
            self.close(case_id)
        return idle

    def close_all(self) -> None:
        """Stop everything, at shutdown."""
        for case_id in self.ids():
            self.close(case_id)

    def watched(self, case_id: str, change: int, window: str = "") -> int:
        """A browser's window came (+1) or went (-1); returns how many watch now."""
        with self._lock:
            view = self._views.get(case_id)
            if view is None:
                return 0
            # What is left of a view that was stopped may come to its successor: less than nothing is nothing.
            view.windows[window] += change
            view.windows = +view.windows
            view.last_seen = self._clock()
            return view.watchers

    def is_watched(self, case_id: str, window: str = "") -> bool:
        """Whether a browser, or this very window of one, is attached to the view."""
        view = self._views.get(case_id)
        if view is None:
            return False
        return view.windows[window] > 0 if window else view.watchers > 0

    def _start(self, case_id: str, build: Callable[[viser.ViserServer], Content]) -> OpenView[Content]:
        if len(self._views) >= self._most_open:
            raise ViewsFull
        server = start_server()
        try:
            content = build(server)
        except BaseException:
            server.stop()
            raise
        view = OpenView(server, content, server.get_port())
        self._views[case_id] = view
        return view
