"""A warm process that has already imported the heavy libraries and forks one confined child per request.

It is started by exec, so it inherits neither threads nor locks of the process it serves, and it ends when that
process does: its end of the control socket closes.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
import subprocess  # nosec B404
import sys
import threading
from collections.abc import Callable, Sequence

from lubdub.jobs.sandbox import ChildResult, Limits, supervise
from lubdub.jobs.warm_process import READY, STARTED, Request
from lubdub.results import Progress

START_S = 120  # a cold disk reads Open3D in 20 s

log = logging.getLogger(__name__)


class ForkServerFailed(RuntimeError):
    """The warm process could not start, or died while it was asked for a child."""


class ForkServer:
    """Children from a warm process. All methods may be called from several threads at once.

    preload: modules to import before the first request, and warm-up functions as "module:function", called
    without arguments. A warm-up must not start threads of its own (OpenMP's do not survive a fork).
    """

    def __init__(self, preload: Sequence[str] = ()) -> None:
        self._preload = tuple(preload)
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None

    def start(self) -> None:
        """Start the warm process and wait until it is ready. Raises ForkServerFailed."""
        with self._lock:
            self._ensure_running()

    @property
    def pid(self) -> int:
        """The process id of the warm process. Raises ForkServerFailed when it does not run."""
        if self._process is None:
            raise ForkServerFailed("the process that reads scans is not running")
        return self._process.pid

    def stop(self) -> None:
        """End the warm process and every child it has. Harmless when it is not running."""
        with self._lock:
            self._discard()

    def run(
        self,
        task: str,
        payload: bytes,
        limits: Limits,
        on_progress: Progress,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> ChildResult:
        """Call the task named "module:function" as `function(payload, progress)` in a fresh confined child.

        Starts the warm process again when it has died. Raises ForkServerFailed when it dies at this work.
        """
        request = Request(task, limits)
        child = self._request(request, payload) or self._request(request, payload)
        if child is None:
            raise ForkServerFailed("the process that reads scans dies again and again")
        return supervise(child, limits, on_progress, cancelled)

    def _request(self, request: Request, payload: bytes) -> _RemoteChild | None:
        """A child at work; None when the warm process turned out to be dead."""
        with contextlib.ExitStack() as ours:
            letter = os.memfd_create("payload")
            ours.callback(os.close, letter)
            with open(letter, "wb", closefd=False) as file:
                file.write(payload)
            output, child_end = os.pipe()
            ours.callback(os.close, child_end)
            leash, server_end = socket.socketpair()
            ours.enter_context(server_end)
            asked = self._send(request.to_bytes(), [letter, child_end, server_end.fileno()])
        if leash.recv(len(STARTED)) == STARTED:
            return _RemoteChild(output, leash)
        os.close(output)
        leash.close()
        self._bury(asked)
        return None

    def _send(self, message: bytes, descriptors: list[int]) -> subprocess.Popen[bytes] | None:
        with self._lock:
            control = self._ensure_running()
            with contextlib.suppress(OSError):  # a dead process; the missing answer tells the same
                socket.send_fds(control, [message], descriptors)
            return self._process

    def _bury(self, process: subprocess.Popen[bytes] | None) -> None:
        """Forget a process that did not answer, unless another thread has done so and started a new one."""
        with self._lock:
            if self._process is process:
                log.warning("the process that reads scans has died and is started again")
                self._discard()

    def _ensure_running(self) -> socket.socket:
        if self._process is not None and self._process.poll() is not None:
            self._discard()
        if self._control is None:
            self._control = self._spawn()
        return self._control

    def _spawn(self) -> socket.socket:
        control, server_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        # No settings: among them are the master key and the database's password, and strangers' files are read there.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("LUBDUB_")}
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
        with server_end:
            self._process = subprocess.Popen(  # nosec B603
                [sys.executable, "-m", "lubdub.jobs.warm_process", str(server_end.fileno()), *self._preload],
                pass_fds=[server_end.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=environment,
                start_new_session=True,  # Ctrl-C in a terminal is for the parent, which then ends this one
            )
        control.settimeout(START_S)
        with contextlib.suppress(OSError):
            if control.recv(len(READY)) == READY:
                control.settimeout(None)
                return control
        control.close()
        self._discard()
        raise ForkServerFailed("the process that reads scans could not start; see its message above")

    def _discard(self) -> None:
        if self._control is not None:
            self._control.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._process = self._control = None


class _RemoteChild:
    """A child of the fork server, held by a leash: a word or the end of the leash ends the child."""

    def __init__(self, output: int, leash: socket.socket) -> None:
        self.output = output
        self._leash = leash

    def kill(self) -> None:
        with contextlib.suppress(OSError):
            self._leash.send(b"k")

    def wait(self) -> int:
        """The exit code the server reports. Raises ForkServerFailed when the server died, and the child with it."""
        with self._leash:
            answer = self._leash.recv(64)
        if not answer:
            raise ForkServerFailed("the process that reads scans died at work; try again")
        return int(answer)
