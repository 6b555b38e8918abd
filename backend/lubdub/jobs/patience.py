"""Waiting for a database or store that is away, so that a restart of either costs a job nothing but time."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TypeVar

from lubdub.cases.away import is_away

SHORTEST_PAUSE_S, LONGEST_PAUSE_S = 0.2, 5.0

T = TypeVar("T")

log = logging.getLogger(__name__)


def patiently(action: Callable[[], T], for_s: float) -> T:
    """What `action` returns, once it returns. It may be called again and again, until `for_s` are over.

    Raises what it raised last, and at once what waiting does not help against.
    """
    deadline = time.monotonic() + for_s
    pause = SHORTEST_PAUSE_S
    while True:
        try:
            return action()
        except Exception as error:
            if not is_away(error) or time.monotonic() + pause > deadline:
                raise
            log.warning("the database or the store is away and is waited for: %s", type(error).__name__)
        time.sleep(pause)
        pause = min(2 * pause, LONGEST_PAUSE_S)
