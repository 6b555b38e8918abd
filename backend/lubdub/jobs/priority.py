"""Jobs give way: where pages and jobs share processors, a page does not wait for a job."""

from __future__ import annotations

import os
import time
from pathlib import Path

NICENESS = 10
"""Against one process that computes as hard, a worker's jobs get a tenth of a processor: little, but never nothing."""
SESSION = Path("/proc/self/autogroup")
TRIES, PAUSE_S = 50, 0.1
"""The kernel lets all unprivileged processes together change one session in a tenth of a second."""


def give_way() -> None:
    """Lower the priority of this process, which leads a session of its own, and of all that it starts.

    Where Linux shares processors out by session, niceness counts within the session alone; so that gets it too.
    """
    os.nice(NICENESS)
    for _ in range(TRIES):
        try:
            SESSION.write_text(str(NICENESS))
        except BlockingIOError:
            time.sleep(PAUSE_S)
        except OSError:
            return  # this kernel does not share out by session
        else:
            return
