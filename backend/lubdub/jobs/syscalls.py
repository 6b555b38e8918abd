"""System calls that reading a scan never needs, refused by the kernel for the rest of a process's life.

It needs no privileges, so it also closes the network where a process may not move into a network of its own,
as in most containers. Written as a classic BPF program (linux/filter.h, linux/seccomp.h).
"""

from __future__ import annotations

import ctypes
import errno
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass

PR_SET_SECCOMP = 22
SECCOMP_MODE_FILTER = 2
LOAD_WORD, JUMP_IF_EQUAL, JUMP_IF_AT_LEAST, JUMP_IF_ANY_BIT, RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
OFFSET_OF_NUMBER, OFFSET_OF_ARCHITECTURE, OFFSET_OF_FIRST_ARGUMENT, OFFSET_OF_SECOND_ARGUMENT = 0, 4, 16, 24
ALLOW = 0x7FFF0000
ERRNO = 0x00050000
REFUSE, NOT_THERE = ERRNO | errno.EPERM, ERRNO | errno.ENOSYS
X32_CALLS = 0x40000000  # a second set of numbers for the same calls on x86-64
CLONE_THREAD = 0x10000
SET_OWNER, SET_SIGNAL, SET_OWNER_EX = 8, 10, 15  # commands of fcntl that have the kernel signal another process

Step = tuple[int, int, int, int]
"""Code, steps to leap when true, steps to leap when false, number."""


@dataclass(frozen=True)
class Architecture:
    """Its name to the kernel's auditing (linux/audit.h), and its numbers for calls (asm/unistd.h)."""

    audit: int
    refused: dict[str, int]
    clone: int
    clone3: int
    on_a_process: dict[str, int]
    """Calls that may name this process as their first argument, and no other one."""
    fcntl: int


ARCHITECTURES = {
    "x86_64": Architecture(
        audit=0xC000003E,
        refused={
            **{"socket": 41},  # without one nothing can be connected, and inherited ones are closed
            **{"fork": 57, "vfork": 58, "execve": 59, "execveat": 322},
            **{"kill": 62, "tkill": 200, "rt_sigqueueinfo": 129, "rt_tgsigqueueinfo": 297, "pidfd_send_signal": 424},
            **{"ptrace": 101, "process_vm_readv": 310, "process_vm_writev": 311, "pidfd_open": 434, "pidfd_getfd": 438},
            **{"unshare": 272, "setns": 308, "mount": 165, "bpf": 321, "perf_event_open": 298},
            **{"add_key": 248, "request_key": 249, "keyctl": 250, "userfaultfd": 323, "io_uring_setup": 425},
            # Landlock's first versions leave these alone, and a kernel without it has no other guard.
            **{"truncate": 76, "unlink": 87, "unlinkat": 263, "rmdir": 84, "mkdir": 83, "mkdirat": 258, "creat": 85},
            **{"rename": 82, "renameat": 264, "renameat2": 316, "link": 86, "linkat": 265, "symlink": 88},
            **{"symlinkat": 266, "mknod": 133, "mknodat": 259, "chmod": 90, "fchmod": 91, "fchmodat": 268},
            **{"fchmodat2": 452, "chown": 92, "fchown": 93, "lchown": 94, "fchownat": 260, "utimensat": 280},
            # What takes memory that no limit of the process counts.
            **{"shmget": 29, "msgget": 68, "semget": 64, "mq_open": 240, "memfd_create": 319},
        },
        clone=56,
        clone3=435,
        on_a_process={"tgkill": 234, "prlimit64": 302},
        fcntl=72,
    ),
    "aarch64": Architecture(
        audit=0xC00000B7,
        refused={
            **{"socket": 198, "execve": 221, "execveat": 281},
            **{"kill": 129, "tkill": 130, "rt_sigqueueinfo": 138, "rt_tgsigqueueinfo": 240, "pidfd_send_signal": 424},
            **{"ptrace": 117, "process_vm_readv": 270, "process_vm_writev": 271, "pidfd_open": 434, "pidfd_getfd": 438},
            **{"unshare": 97, "setns": 268, "mount": 40, "bpf": 280, "perf_event_open": 241},
            **{"add_key": 217, "request_key": 218, "keyctl": 219, "userfaultfd": 282, "io_uring_setup": 425},
            **{"truncate": 45, "unlinkat": 35, "mkdirat": 34, "renameat": 38, "renameat2": 276, "linkat": 37},
            **{"symlinkat": 36, "mknodat": 33, "fchmod": 52, "fchmodat": 53, "fchmodat2": 452, "fchown": 55},
            **{"fchownat": 54, "utimensat": 88},
            **{"shmget": 194, "msgget": 186, "semget": 190, "mq_open": 180, "memfd_create": 279},
        },
        clone=220,
        clone3=435,
        on_a_process={"tgkill": 131, "prlimit64": 261},
        fcntl=25,
    ),
}


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
    """Refuse the calls to this thread and all it starts; False where that is not possible.

    The process must have given up new privileges (PR_SET_NO_NEW_PRIVS) before.
    """
    architecture = ARCHITECTURES.get(platform.machine())
    if architecture is None:
        return False
    listing = [_Instruction(*step) for step in _steps(architecture, os.getpid())]
    program = _Program(len(listing), (_Instruction * len(listing))(*listing))
    libc = ctypes.CDLL(None, use_errno=True)
    return bool(libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.byref(program), 0, 0) == 0)


def _steps(architecture: Architecture, own_pid: int) -> Iterator[Step]:
    yield (LOAD_WORD, 0, 0, OFFSET_OF_ARCHITECTURE)
    yield (JUMP_IF_EQUAL, 1, 0, architecture.audit)
    yield (RETURN, 0, 0, REFUSE)
    yield (LOAD_WORD, 0, 0, OFFSET_OF_NUMBER)
    yield (JUMP_IF_AT_LEAST, 0, 1, X32_CALLS)
    yield (RETURN, 0, 0, REFUSE)
    for number in architecture.refused.values():
        yield from _if_called(number, [(RETURN, 0, 0, REFUSE)])
    yield from _if_called(architecture.clone, _threads_alone())
    # Its flags lie in memory, where this program cannot look; without it the C library takes clone.
    yield from _if_called(architecture.clone3, [(RETURN, 0, 0, NOT_THERE)])
    for number in architecture.on_a_process.values():
        yield from _if_called(number, _on_itself(own_pid))
    yield from _if_called(architecture.fcntl, _no_signals_by_descriptor())
    yield (RETURN, 0, 0, ALLOW)


def _if_called(number: int, steps: list[Step]) -> Iterator[Step]:
    """The steps for one call. They must end in a return: behind them the call's number is looked at again."""
    yield (JUMP_IF_EQUAL, 0, len(steps), number)
    yield from steps


def _threads_alone() -> list[Step]:
    return [
        (LOAD_WORD, 0, 0, OFFSET_OF_FIRST_ARGUMENT),
        (JUMP_IF_ANY_BIT, 0, 1, CLONE_THREAD),
        (RETURN, 0, 0, ALLOW),
        (RETURN, 0, 0, REFUSE),
    ]


def _on_itself(own_pid: int) -> list[Step]:
    """Zero means the caller, too."""
    return [
        (LOAD_WORD, 0, 0, OFFSET_OF_FIRST_ARGUMENT),
        (JUMP_IF_EQUAL, 1, 0, own_pid),
        (JUMP_IF_EQUAL, 0, 1, 0),
        (RETURN, 0, 0, ALLOW),
        (RETURN, 0, 0, REFUSE),
    ]


def _no_signals_by_descriptor() -> list[Step]:
    return [
        (LOAD_WORD, 0, 0, OFFSET_OF_SECOND_ARGUMENT),
        (JUMP_IF_EQUAL, 3, 0, SET_OWNER),
        (JUMP_IF_EQUAL, 2, 0, SET_SIGNAL),
        (JUMP_IF_EQUAL, 1, 0, SET_OWNER_EX),
        (RETURN, 0, 0, ALLOW),
        (RETURN, 0, 0, REFUSE),
    ]
