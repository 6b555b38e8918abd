"""Run one function in a child process that may crash, hang or be hostile, and say in one word how it ended."""

from __future__ import annotations

import logging
import os
import selectors
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal, Protocol

from lubdub.jobs import frames
from lubdub.jobs.child import Cell, Task, Work, enter, fork
from lubdub.jobs.confinement import Limits
from lubdub.results import Progress

__all__ = ["Child", "ChildResult", "Limits", "Task", "kill_group", "run_in_child", "supervise"]

Status = Literal["ok", "unreadable", "refused", "crashed", "timeout", "cancelled", "memory", "error"]

TICK_S = 0.1  # how often a cancellation is looked for; it must be felt within half a second

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ChildResult:
    """How a child ended.

    payload: the task's answer when "ok", the reason as JSON when "refused". detail: one sentence for a person;
    a traceback goes to the log only.
    """

    status: Status
    payload: bytes = b""
    detail: str = ""


class Child(Protocol):
    """A running child, however it was started."""

    output: int
    """The readable end of the pipe its frames arrive on."""

    def kill(self) -> None:
        """End it now; harmless when it has ended already."""

    def wait(self) -> int:
        """Its exit code, negative for the signal that ended it. Called once, after the output ended."""


def run_in_child(
    function: Task,
    payload: bytes,
    limits: Limits,
    on_progress: Progress,
    cancelled: Callable[[], bool] = lambda: False,
) -> ChildResult:
    """Call `function(payload, progress)` in a confined child of this process and wait for it.

    on_progress and cancelled are called here, in the parent; when one of them raises, the child is ended first.
    """
    child = _fork(lambda progress: function(payload, progress), Cell(limits, os.getpid()))
    return supervise(child, limits, on_progress, cancelled)


def supervise(child: Child, limits: Limits, on_progress: Progress, cancelled: Callable[[], bool]) -> ChildResult:
    """Read a child's frames until it ends, and end it at the wall-clock limit or on cancellation."""
    ended_by_us: ChildResult | None = None
    reader = frames.Reader()
    try:
        ended_by_us = _listen(child, reader, time.monotonic() + limits.wall_s, on_progress, cancelled)
    finally:
        child.kill()
        os.close(child.output)
        exit_code = child.wait()
    return ended_by_us or _judge(reader, exit_code, limits)


def _listen(
    child: Child, reader: frames.Reader, deadline: float, on_progress: Progress, cancelled: Callable[[], bool]
) -> ChildResult | None:
    with selectors.DefaultSelector() as selector:
        selector.register(child.output, selectors.EVENT_READ)
        while True:
            if cancelled():
                return ChildResult("cancelled", detail="The work was cancelled.")
            if time.monotonic() > deadline:
                return ChildResult("timeout", detail="The work took too long and was stopped.")
            if not selector.select(TICK_S):
                continue
            block = os.read(child.output, frames.BLOCK_BYTES)
            if not block:
                return None
            try:
                for stage, fraction in reader.feed(block):
                    on_progress(stage, fraction)
            except frames.BadFrame as fault:
                log.error("a sandboxed child broke the protocol: %s", fault)
                return ChildResult("crashed", detail="This file cannot be read: it breaks the reader.")


def _judge(reader: frames.Reader, exit_code: int, limits: Limits) -> ChildResult:
    if reader.final is not None:
        kind, body = reader.final
        return _from_final(kind, body, limits)
    if exit_code == -signal.SIGXCPU:
        return ChildResult(
            "timeout", detail=f"The work needed more than {limits.cpu_s:g} s of computing and was stopped."
        )
    log.error("a sandboxed child ended without an answer, exit code %s", exit_code)
    return ChildResult("crashed", detail="This file cannot be read: it breaks the reader.")


def _from_final(kind: frames.Kind, body: bytes, limits: Limits) -> ChildResult:
    text = body.decode("utf-8", "replace")
    match kind:
        case frames.Kind.RESULT:
            return ChildResult("ok", body)
        case frames.Kind.UNREADABLE:
            return ChildResult("unreadable", body, " ".join(frames.reason_texts(body)).strip())
        case frames.Kind.REFUSED:
            return ChildResult("refused", body, frames.reason_texts(body)[0])
        case frames.Kind.MEMORY:
            return ChildResult(
                "memory", detail=f"The scan needs more than the {limits.memory_mb} MB of memory allowed."
            )
        case _:
            log.error("a sandboxed child failed\n%s", text)
            return ChildResult("error", detail="Something went wrong inside Lubdub; the log says what.")


class _ForkedChild:
    """A child forked from this very process."""

    def __init__(self, pid: int, output: int) -> None:
        self.pid = pid
        self.output = output

    def kill(self) -> None:
        kill_group(self.pid)

    def wait(self) -> int:
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def _fork(work: Work, cell: Cell) -> _ForkedChild:
    output, child_end = os.pipe()
    try:
        pid = fork()
    except OSError:
        os.close(output)
        os.close(child_end)
        raise
    if pid == 0:
        enter(work, child_end, cell)
    os.close(child_end)
    return _ForkedChild(pid, output)


def kill_group(pid: int) -> None:
    """End an unreaped child and whatever it started. It may not lead a group of its own yet."""
    with suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
