"""What the sandbox tests run in a child; importable by name, as the fork server needs."""

from __future__ import annotations

import ctypes
import json
import os
import socket
import sys
import time

import numpy as np

from lubdub.results import Progress, Reason, ScanRefused, ScanUnreadable

WARMED: list[str] = []


def warm_up() -> None:
    WARMED.append("warm")


def echo(payload: bytes, progress: Progress) -> bytes:
    progress("read", 0.25)
    progress("fit", 0.75)
    return payload


def say_whether_warm(payload: bytes, progress: Progress) -> bytes:
    return json.dumps(WARMED).encode()


def unreadable(payload: bytes, progress: Progress) -> bytes:
    raise ScanUnreadable(Reason("unreadable_file", "This is no scan.", "Send another."))


def refused(payload: bytes, progress: Progress) -> bytes:
    raise ScanRefused(Reason("mirrored_scan", "The scan is mirrored.", "Scan again."))


def fail(payload: bytes, progress: Progress) -> bytes:
    raise KeyError("secret inner detail")


def leave(payload: bytes, progress: Progress) -> bytes:
    sys.exit(0)


def crash(payload: bytes, progress: Progress) -> bytes:
    ctypes.string_at(0)
    return b""


def vanish(payload: bytes, progress: Progress) -> bytes:
    os._exit(0)


def hang(payload: bytes, progress: Progress) -> bytes:
    progress("fit", 0.5)
    time.sleep(600)
    return b""


def compute_for_ever(payload: bytes, progress: Progress) -> bytes:
    while True:
        pass


def allocate(payload: bytes, progress: Progress) -> bytes:
    """payload: how many bytes, as text; every page is touched."""
    return str(np.ones(int(payload), dtype=np.uint8).sum(dtype=np.int64)).encode()


def open_many_files(payload: bytes, progress: Progress) -> bytes:
    opened = [os.open(os.devnull, os.O_RDONLY) for _ in range(1000)]
    return str(len(opened)).encode()


def call_out(payload: bytes, progress: Progress) -> bytes:
    with socket.create_connection(("127.0.0.1", int(payload)), timeout=5):
        return b"connected"


def become_root(payload: bytes, progress: Progress) -> bytes:
    os.setuid(12345)
    return b"still mighty"


def speak_nonsense(payload: bytes, progress: Progress) -> bytes:
    for number in os.listdir("/proc/self/fd"):
        if int(number) > 2:
            try:
                os.write(int(number), payload)
            except OSError:
                continue
    time.sleep(600)
    return b""


def answer_too_much(payload: bytes, progress: Progress) -> bytes:
    return bytes(257 * 2**20)


def list_descriptors(payload: bytes, progress: Progress) -> bytes:
    targets = []
    for number in os.listdir("/proc/self/fd"):
        try:
            targets.append(os.readlink(f"/proc/self/fd/{number}"))
        except FileNotFoundError:
            continue  # the listing's own
    return json.dumps(targets).encode()


def chatter(payload: bytes, progress: Progress) -> bytes:
    os.write(1, b"noise from a library")
    os.write(2, b"and its complaint")
    return os.read(0, 100) + b"quiet"


def own_pid_then_hang(payload: bytes, progress: Progress) -> bytes:
    progress(str(os.getpid()), 0.0)
    time.sleep(600)
    return b""


def solve(payload: bytes, progress: Progress) -> bytes:
    """Dense and sparse linear algebra on all threads, as the real work does it."""
    import scipy.sparse
    import scipy.sparse.linalg

    matrix = np.eye(1500) * 1500 + np.ones((1500, 1500))
    dense = np.linalg.solve(matrix, np.ones(1500))
    laplacian = scipy.sparse.diags([-1.0, 2.1, -1.0], [-1, 0, 1], shape=(50_000, 50_000), format="csc")
    sparse = scipy.sparse.linalg.splu(laplacian).solve(np.ones(50_000))
    return json.dumps([float(dense.sum()), float(sparse.max())]).encode()


def abort(payload: bytes, progress: Progress) -> bytes:
    os.abort()


def read_a_file(payload: bytes, progress: Progress) -> bytes:
    with open(payload, "rb") as file:
        return file.read()


def overwrite_a_file(payload: bytes, progress: Progress) -> bytes:
    with open(payload, "wb") as file:
        return str(file.write(b"mine now")).encode()
