"""`python -m lubdub.jobs.alive`: whether workers do their rounds, for the health check of a worker's container.

The database is asked, not the process: one that hangs still runs, but is not seen.
"""

from __future__ import annotations

import sys
from datetime import timedelta

from lubdub.cases.opening import CannotOpen, open_cases
from lubdub.cases.work import WorkDesk
from lubdub.settings import Settings

SEEN = timedelta(seconds=30)
"""A worker tells that it lives every few seconds."""


def why_not(settings: Settings) -> str | None:
    """What is wrong, in a sentence; None when a worker was seen lately."""
    try:
        database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    except CannotOpen as error:
        return str(error)
    try:
        seen = WorkDesk(database, vault).seen_within(SEEN)
    finally:
        database.close()
    if not seen:
        return f"No worker was seen for {SEEN.total_seconds():.0f} seconds."
    return None


if __name__ == "__main__":
    sys.exit(why_not(Settings()))
