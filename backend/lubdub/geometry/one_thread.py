"""Open3D on one thread, so that the same scan gives the same bytes on every machine."""

from __future__ import annotations

import os
from functools import cache
from typing import Any


@cache
def one_threaded_open3d() -> Any:
    """The open3d module, its threads bound to one for the rest of this process.

    With two, its RANSAC finds now this and now that overlay of the same bodies, and its ICP adds up in another order;
    on bodies of a thousand points it is no quicker. Open3D has no setting for it: its thread pool (oneTBB) counts the
    processors open to the process when it is loaded. Where a process cannot be bound (macOS), threads stay as they
    are. Everybody must load Open3D through here: who is first decides.
    """
    if not hasattr(os, "sched_setaffinity"):
        import open3d

        return open3d
    process = os.getpid()
    processors = os.sched_getaffinity(process)
    os.sched_setaffinity(process, {min(processors)})
    try:
        import open3d
    finally:
        os.sched_setaffinity(process, processors)
    return open3d
