"""What code that a hostile file smuggled into the reader would try. Each is done in a child; none may succeed.

payload: the path or the number it is about.
"""

from __future__ import annotations

import ctypes
import fcntl
import mmap
import os
import resource
import signal
import socket
import threading
import time
from pathlib import Path

from lubdub.results import Progress

TGKILL = {"x86_64": 234, "aarch64": 131}


def start_a_program(payload: bytes, progress: Progress) -> bytes:
    os.execv("/bin/true", ["true"])


def start_processes_for_ever(payload: bytes, progress: Progress) -> bytes:
    while True:
        os.fork()


def start_a_process_past_the_library(payload: bytes, progress: Progress) -> bytes:
    clone = {"x86_64": 56, "aarch64": 220}[os.uname().machine]
    return _done(ctypes.CDLL(None, use_errno=True).syscall(clone, signal.SIGCHLD, 0, 0, 0, 0))


def start_threads_for_ever(payload: bytes, progress: Progress) -> bytes:
    while True:
        threading.Thread(target=time.sleep, args=(600,), daemon=True).start()


def kill_the_parent(payload: bytes, progress: Progress) -> bytes:
    os.kill(os.getppid(), signal.SIGKILL)
    return b"killed"


def kill_a_thread_of_the_parent(payload: bytes, progress: Progress) -> bytes:
    parent = os.getppid()
    call = TGKILL[os.uname().machine]
    return _done(ctypes.CDLL(None, use_errno=True).syscall(call, parent, parent, int(signal.SIGKILL)))


def starve_the_parent(payload: bytes, progress: Progress) -> bytes:
    resource.prlimit(os.getppid(), resource.RLIMIT_CPU, (1, 1))
    return b"starved"


def have_the_kernel_signal_the_parent(payload: bytes, progress: Progress) -> bytes:
    readable, _ = os.pipe()
    fcntl.fcntl(readable, fcntl.F_SETOWN, os.getppid())
    return b"owned"


def connect(payload: bytes, progress: Progress) -> bytes:
    with socket.create_connection(("127.0.0.1", int(payload)), timeout=5):
        return b"connected"


def open_a_local_socket(payload: bytes, progress: Progress) -> bytes:
    with socket.socket(socket.AF_UNIX):
        return b"made"


def write_a_file(payload: bytes, progress: Progress) -> bytes:
    with open(os.path.join(os.fsdecode(payload), "mine"), "wb") as file:
        return str(file.write(bytes(4096))).encode()


def make_a_folder(payload: bytes, progress: Progress) -> bytes:
    os.mkdir(os.path.join(os.fsdecode(payload), "mine"))
    return b"made"


def overwrite(payload: bytes, progress: Progress) -> bytes:
    with open(payload, "r+b") as file:
        return str(file.write(b"mine now")).encode()


def empty(payload: bytes, progress: Progress) -> bytes:
    os.truncate(payload, 0)
    return b"emptied"


def remove(payload: bytes, progress: Progress) -> bytes:
    os.unlink(payload)
    return b"removed"


def rename(payload: bytes, progress: Progress) -> bytes:
    os.rename(payload, payload + b".mine")
    return b"renamed"


def lock_everybody_out(payload: bytes, progress: Progress) -> bytes:
    os.chmod(payload, 0)
    return b"locked"


def read(payload: bytes, progress: Progress) -> bytes:
    return Path(os.fsdecode(payload)).read_bytes()


def list_a_folder(payload: bytes, progress: Progress) -> bytes:
    return b" ".join(map(os.fsencode, os.listdir(os.path.dirname(os.fsdecode(payload)))))


def read_the_parents_environment(payload: bytes, progress: Progress) -> bytes:
    return Path(f"/proc/{os.getppid()}/environ").read_bytes()


def become_root(payload: bytes, progress: Progress) -> bytes:
    os.setuid(12345)
    return b"still mighty"


def hide_memory_in_a_file(payload: bytes, progress: Progress) -> bytes:
    hidden = os.memfd_create("hidden")
    return str(os.write(hidden, bytes(mmap.PAGESIZE))).encode()


def hide_memory_in_a_shared_segment(payload: bytes, progress: Progress) -> bytes:
    return _done(ctypes.CDLL(None, use_errno=True).shmget(0, ctypes.c_size_t(2**20), 0o600))


def _done(code: int) -> bytes:
    if code < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return b"done"
