"""A list of system calls that reading a scan never needs, refused by the kernel for the rest of a process's life.

It needs no privileges, so it also closes the network where a process may not move into a network of its own,
as in most containers. Written as a classic BPF program (linux/filter.h, linux/seccomp.h).
"""

from __future__ import annotations

import ctypes
import errno
import platform
from collections.abc import Iterable
from dataclasses import dataclass

PR_SET_SECCOMP = 22
SECCOMP_MODE_FILTER = 2
LOAD_WORD, JUMP_IF_EQUAL, JUMP_IF_AT_LEAST, RETURN = 0x20, 0x15, 0x35, 0x06
OFFSET_OF_NUMBER, OFFSET_OF_ARCHITECTURE = 0, 4
ALLOW = 0x7FFF0000
REFUSE = 0x00050000 | errno.EPERM
X32_CALLS = 0x40000000  # a second set of numbers for the same calls on x86-64

NAMES = (
    *("socket",),  # without one nothing can be connected, and inherited ones are closed
    *("execve", "execveat"),
    *("kill", "tkill", "ptrace", "process_vm_readv", "process_vm_writev", "pidfd_open", "pidfd_getfd"),
    *("unshare", "setns", "mount", "bpf", "perf_event_open", "add_key", "request_key", "keyctl"),
    *("userfaultfd", "io_uring_setup"),
)
_X86_64 = (41, 59, 322, 62, 200, 101, 310, 311, 434, 438, 272, 308, 165, 321, 298, 248, 249, 250, 323, 425)
_AARCH64 = (198, 221, 281, 129, 130, 117, 270, 271, 434, 438, 97, 268, 40, 280, 241, 217, 218, 219, 282, 425)


@dataclass(frozen=True)
class Architecture:
    """Its name to the kernel's auditing (linux/audit.h), and the numbers of NAMES on it (asm/unistd.h)."""

    audit: int
    numbers: tuple[int, ...]


ARCHITECTURES = {"x86_64": Architecture(0xC000003E, _X86_64), "aarch64": Architecture(0xC00000B7, _AARCH64)}


class _Instruction(ctypes.Structure):
    _fields_ = (
        ("code", ctypes.c_uint16),
        ("then", ctypes.c_uint8),
        ("otherwise", ctypes.c_uint8),
        ("k", ctypes.c_uint32),
    )


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_uint16), ("instructions", ctypes.POINTER(_Instruction)))


def refuse_calls() -> bool:
    """Refuse the calls of NAMES to this thread and all it starts; False where that is not possible.

    The process must have given up new privileges (PR_SET_NO_NEW_PRIVS) before.
    """
    architecture = ARCHITECTURES.get(platform.machine())
    if architecture is None:
        return False
    listing = [_Instruction(*words) for words in _instructions(architecture)]
    program = _Program(len(listing), (_Instruction * len(listing))(*listing))
    libc = ctypes.CDLL(None, use_errno=True)
    return bool(libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.byref(program), 0, 0) == 0)


def _instructions(architecture: Architecture) -> Iterable[tuple[int, int, int, int]]:
    """Foreign architecture or numbering: refuse. A listed call: refuse. Anything else: allow."""
    count = len(architecture.numbers)
    yield (LOAD_WORD, 0, 0, OFFSET_OF_ARCHITECTURE)
    yield (JUMP_IF_EQUAL, 0, count + 3, architecture.audit)
    yield (LOAD_WORD, 0, 0, OFFSET_OF_NUMBER)
    yield (JUMP_IF_AT_LEAST, count + 1, 0, X32_CALLS)
    for index, number in enumerate(architecture.numbers):
        yield (JUMP_IF_EQUAL, count - index, 0, number)
    yield (RETURN, 0, 0, ALLOW)
    yield (RETURN, 0, 0, REFUSE)
