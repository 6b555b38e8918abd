"""`python -m lubdub.jobs.alive`: whether this container's worker does its rounds, for the container's health check.

Not the process is asked, for one that hangs still runs, and not the database, which knows of every worker and may be
away, when a new start of the worker would not help.
"""

from __future__ import annotations

import logging
import sys
import time
from pathlib import Path

from lubdub.settings import Settings

SEEN_S = 60.0
"""A worker does a round every few seconds, more slowly while it waits for a database."""

log = logging.getLogger(__name__)


def show_alive(pulse: Path | None) -> None:
    """A round begins. A file that cannot be renewed keeps nobody from work: the check will find it old."""
    if pulse is None:
        return
    try:
        pulse.touch()
    except OSError as error:
        log.warning("the worker's pulse cannot be renewed: %s", type(error).__name__)


def why_not(settings: Settings) -> str | None:
    """What is wrong, in a sentence; None when the worker did a round lately."""
    pulse = settings.worker_pulse
    if pulse is None:
        return "LUBDUB_WORKER_PULSE names no file. Give it to the worker and to this check alike."
    if not pulse.exists():
        return "The worker has not done a round yet."
    silent_s = time.time() - pulse.stat().st_mtime
    return f"The worker has done nothing for {silent_s:.0f} seconds." if silent_s > SEEN_S else None


if __name__ == "__main__":
    sys.exit(why_not(Settings()))
