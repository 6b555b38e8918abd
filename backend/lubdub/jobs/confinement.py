"""What a child process gives up before it touches a stranger's file: memory, time, files, privileges, network.

It writes no file at all, and starts no other process: its answer goes through a pipe.
"""

from __future__ import annotations

import ctypes
import functools
import json
import math
import os
import resource
import signal
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from lubdub.jobs.filesystem import see_only
from lubdub.jobs.syscalls import refuse_calls

# linux/prctl.h, linux/sched.h and linux/capability.h; Python 3.11 has no names for them.
PR_SET_PDEATHSIG = 1
PR_SET_DUMPABLE = 4
PR_SET_NO_NEW_PRIVS = 38
CLONE_NEWUSER = 0x10000000
CLONE_NEWNET = 0x40000000
CAPABILITY_VERSION_3 = 0x20080522

MEBIBYTE = 2**20


@dataclass(frozen=True)
class Limits:
    """What one child may use.

    memory_mb counts the address space mapped beyond what the process held when it was forked, so that a warm
    process with Open3D loaded and a cold one give the same room for work. cpu_s sums over all its threads.
    """

    memory_mb: int = 3584  # a full fit stays below 1.5 GB, importing Open3D and SciPy maps 0.75 GB
    cpu_s: float = 60
    wall_s: float = 90
    open_files: int = 64  # enough for the imports; a process that opens more is not reading one scan
    readable: tuple[str, ...] = ()  # folders it may read besides the system's, Python's and the references

    def to_json(self) -> dict[str, float]:
        """As `/readyz` says it; no folder's name is said."""
        said = {"memory_mb": self.memory_mb, "cpu_s": self.cpu_s, "wall_s": self.wall_s, "open_files": self.open_files}
        return {**said, "written_bytes": 0}


@dataclass(frozen=True)
class Protection:
    """What the kernel takes away from children here, beyond the limits that every kernel has."""

    no_network: bool = False
    other_files_hidden: bool = False
    """The key, the database and other people's scans; see `filesystem`."""
    no_other_processes: bool = False
    """No programs, no processes of its own, no signals to others; see `syscalls`."""
    no_new_privileges: bool = False

    def to_json(self) -> dict[str, bool]:
        """As `/readyz` says it."""
        return asdict(self)


def confine(limits: Limits, parent: int) -> Protection:
    """Give up everything that reading one scan does not need. Called in the child, right after the fork.

    `parent` is the process id that must stay alive for this one to go on. Raises OSError when a limit that
    every Linux kernel has cannot be set.
    """
    os.chdir("/")
    _set_limits(limits)
    if sys.platform != "linux":
        return Protection()
    has_no_network = leave_network()
    _drop_capabilities()
    _prctl(PR_SET_NO_NEW_PRIVS, 1)
    _prctl(PR_SET_DUMPABLE, 0)
    files_hidden = see_only(limits.readable)
    calls_refused = refuse_calls()
    # Last, because the kernel forgets it when credentials change.
    _prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
    return Protection(has_no_network or calls_refused, files_hidden, calls_refused, no_new_privileges=True)


@functools.cache
def protection() -> Protection:
    """What holds for children here. Asked once, by confining a throw-away process."""
    answer, child_end = os.pipe()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        try:
            os.write(child_end, json.dumps(confine(Limits(), parent).to_json()).encode())
        finally:
            os._exit(0)
    os.close(child_end)
    with open(answer, "rb") as pipe:
        told = pipe.read()
    os.waitpid(child, 0)
    if not told:
        raise OSError("a process cannot be confined on this machine")
    return Protection(**json.loads(told))


def leave_network() -> bool:
    """Move this process into an empty network of its own; False where the kernel does not permit it."""
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.geteuid(), os.getegid()
    if libc.unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0:
        return False
    # Keep our own name inside; the mapping is a courtesy to libraries that ask who they run as.
    for name, text in (("setgroups", "deny"), ("uid_map", f"{user} {user} 1"), ("gid_map", f"{group} {group} 1")):
        try:
            Path("/proc/self", name).write_text(text)
        except OSError:
            return True
    return True


def _set_limits(limits: Limits) -> None:
    _limit(resource.RLIMIT_AS, _mapped_bytes() + limits.memory_mb * MEBIBYTE)
    _limit(
        resource.RLIMIT_CPU, math.ceil(limits.cpu_s), grace=1
    )  # SIGXCPU first, so that the end can be told from a crash
    _limit(resource.RLIMIT_FSIZE, 0)
    _limit(resource.RLIMIT_NOFILE, limits.open_files)
    _limit(resource.RLIMIT_CORE, 0)


def _limit(which: int, value: int, grace: int = 0) -> None:
    hard = resource.getrlimit(which)[1]
    highest = value + grace if hard == resource.RLIM_INFINITY else min(value + grace, hard)
    resource.setrlimit(which, (min(value, highest), highest))


def _mapped_bytes() -> int:
    """The address space this process holds now, in bytes; 0 where the system does not say."""
    try:
        pages = Path("/proc/self/statm").read_text().split()[0]
    except OSError:
        return 0
    return int(pages) * resource.getpagesize()


def _drop_capabilities() -> None:
    """Leave the process without root's powers, also those a fresh user namespace hands out."""
    libc = ctypes.CDLL(None, use_errno=True)
    header = (ctypes.c_uint32 * 2)(CAPABILITY_VERSION_3, 0)
    nothing = (ctypes.c_uint32 * 6)()
    if libc.capset(header, nothing) != 0:
        raise OSError(ctypes.get_errno(), "capabilities could not be dropped")


def _prctl(option: int, value: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(option, ctypes.c_ulong(value), 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), f"prctl {option} was refused")
