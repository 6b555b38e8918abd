"""`python -m lubdub.jobs.alive`: whether workers do their rounds, for the health check of a worker's container.

The database is asked, not the process: one that hangs still runs, but is not seen.
"""

from __future__ import annotations

import sys
from datetime import timedelta

from lubdub.cases.clock import now
from lubdub.cases.opening import CannotOpen, open_cases
from lubdub.cases.work import WorkDesk
from lubdub.settings import Settings

SEEN = timedelta(seconds=30)
"""A worker tells that it lives every 5 s."""


def why_not(settings: Settings) -> str | None:
    """What is wrong, in a sentence; None when a worker was seen lately."""
    try:
        database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    except CannotOpen as error:
        return str(error)
    try:
        seen = WorkDesk(database, vault).last_seen()
    finally:
        database.close()
    if seen is None or now() - seen.at > SEEN:
        return f"No worker was seen for {SEEN.total_seconds():.0f} seconds."
    return None


if __name__ == "__main__":
    sys.exit(why_not(Settings()))
