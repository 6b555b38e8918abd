"""The other side of the fork server: a loop in one thread that forks a confined child for each request."""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import selectors
import socket
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from lubdub.jobs.child import Cell, Task, enter, fork
from lubdub.jobs.confinement import Limits
from lubdub.jobs.priority import give_way
from lubdub.jobs.sandbox import kill_group

REQUEST_BYTES = 2**16
READY = b"ready"
STARTED = b"s"


@dataclass(frozen=True)
class Request:
    """What the fork server is asked for: a task by name, under limits."""

    task: str
    limits: Limits

    def to_bytes(self) -> bytes:
        """As it travels over the control socket."""
        return json.dumps({"task": self.task, "limits": asdict(self.limits)}).encode()

    @classmethod
    def from_bytes(cls, data: bytes) -> Request:
        """What `to_bytes` wrote."""
        told: dict[str, Any] = json.loads(data)
        return cls(told["task"], Limits(**told["limits"]))


class Server:
    """The loop of the warm process: take requests, fork, report ends. Runs in one thread and never computes."""

    def __init__(self, control: socket.socket) -> None:
        self._control = control
        self._selector = selectors.DefaultSelector()
        self._selector.register(control, selectors.EVENT_READ, self._take_request)
        self._running = True

    def serve(self) -> None:
        """Until the parent's end of the control socket closes, which it may have done while we warmed up."""
        try:
            self._control.send(READY)
        except BrokenPipeError:
            return
        while self._running:
            for key, _ in self._selector.select():
                if self._selector.get_map().get(key.fd) is key:  # not closed earlier in this round
                    key.data()

    def _take_request(self) -> None:
        message, descriptors, _, _ = socket.recv_fds(self._control, REQUEST_BYTES, 3)
        if not message:
            self._running = False
            return
        letter, output, leash_number = descriptors
        request = Request.from_bytes(message)
        cell = Cell(request.limits, os.getpid())
        pid = fork()
        if pid == 0:
            enter(lambda progress: _load(request.task)(_read_letter(letter), progress), output, cell, (letter,))
        os.close(letter)
        os.close(output)
        leash = socket.socket(fileno=leash_number)
        with contextlib.suppress(OSError):
            leash.send(STARTED)
        self._watch(pid, leash)

    def _watch(self, pid: int, leash: socket.socket) -> None:
        ended = os.pidfd_open(pid)

        def reap() -> None:
            self._selector.unregister(ended)
            os.close(ended)
            with contextlib.suppress(KeyError):
                self._selector.unregister(leash)
            code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
            with leash, contextlib.suppress(OSError):
                leash.send(str(code).encode())

        def pull() -> None:
            self._selector.unregister(leash)
            kill_group(pid)

        self._selector.register(ended, selectors.EVENT_READ, reap)
        self._selector.register(leash, selectors.EVENT_READ, pull)


def _read_letter(letter: int) -> bytes:
    size = os.fstat(letter).st_size
    with open(letter, "rb") as file:
        file.seek(0)
        return file.read(size)


def _load(name: str) -> Task:
    module, _, function = name.partition(":")
    found: Task = getattr(importlib.import_module(module), function)
    return found


def _warm_up(entries: Sequence[str]) -> None:
    for entry in entries:
        module, _, function = entry.partition(":")
        imported = importlib.import_module(module)
        if function:
            getattr(imported, function)()


def main(arguments: Sequence[str]) -> None:
    """Entry of the warm process: the control socket's number, then what to preload."""
    control = socket.socket(fileno=int(arguments[0]))
    control.set_inheritable(False)
    give_way()
    _warm_up(arguments[1:])
    gc.freeze()  # children share these pages; a collection in one of them must not copy them
    Server(control).serve()


if __name__ == "__main__":
    main(sys.argv[1:])
