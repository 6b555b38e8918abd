"""The child's side of the sandbox: shut every door, do the one task, answer on the pipe, end."""

from __future__ import annotations

import json
import os
import signal
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from lubdub.jobs import frames
from lubdub.jobs.confinement import Limits, confine
from lubdub.results import Progress, ScanRefused, ScanUnreadable

Task = Callable[[bytes, Progress], bytes]
Work = Callable[[Progress], bytes]
"""A task with its payload at hand; called inside the confinement."""


@dataclass(frozen=True)
class Cell:
    """What a child works in: its limits, and the process it must not outlive."""

    limits: Limits
    parent: int


def fork() -> int:
    """os.fork, without the warning about threads: numerical libraries' idle threads restart after a fork."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*fork.*", category=DeprecationWarning)
        return os.fork()


def enter(work: Work, output: int, cell: Cell, keep: tuple[int, ...] = ()) -> NoReturn:
    """Become a confined child that answers on `output` and ends. Call it only right after a fork.

    keep: further file descriptors to leave open.
    """
    exit_code = 1
    try:
        _leave_the_parents_things(output, keep)
        exit_code = _do(work, output, cell)
    finally:
        os._exit(exit_code)


def _leave_the_parents_things(output: int, keep: tuple[int, ...]) -> None:
    os.setpgid(0, 0)  # and no session of its own, which would have a priority of its own
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGCHLD):
        signal.signal(number, signal.SIG_DFL)
    nothing = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(nothing, standard)
    lowest = 3
    for kept in sorted({output, *keep}):
        os.closerange(lowest, kept)
        lowest = kept + 1
    os.closerange(lowest, os.sysconf("SC_OPEN_MAX"))


def _do(work: Work, output: int, cell: Cell) -> int:
    def progress(stage: str, fraction: float) -> None:
        frames.send(output, frames.Kind.PROGRESS, frames.progress_body(stage, fraction))

    try:
        confine(cell.limits, cell.parent)
        frames.send(output, frames.Kind.RESULT, work(progress))
    except ScanUnreadable as fault:
        _say(output, frames.Kind.UNREADABLE, json.dumps(fault.reason.to_json()))
    except ScanRefused as fault:
        _say(output, frames.Kind.REFUSED, json.dumps(fault.reason.to_json()))
    except MemoryError:
        _say(output, frames.Kind.MEMORY, "")
    except BaseException:  # nothing may pass: above us is the parent's code
        _say(output, frames.Kind.ERROR, traceback.format_exc()[-10_000:])
    return 0


def _say(output: int, kind: frames.Kind, words: str) -> None:
    frames.send(output, kind, words.encode("utf-8", "replace"))
