"""What a child may see of the disk: the system's and Python's own files to read, and nothing to write.

The keys, the database and other people's scans are not among them. Done with Landlock (linux/landlock.h), which
needs no privileges; a kernel without it leaves the files to their ordinary permissions.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterable
from pathlib import Path

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446  # the same numbers on every architecture
PATH_BENEATH = 1
EVERYTHING = (1 << 13) - 1  # all rights of the first version of Landlock
READ_FILE, READ_FOLDER = 1 << 2, 1 << 3
WRITE_FILE = 1 << 1

SYSTEM = ("/usr", "/lib", "/lib64", "/etc", "/sys/devices/system/cpu", "/dev/urandom", "/dev/random")
OWN_PROCESS = ("/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat", "/proc/sys")
PROJECT_PARTS = ("references", ".system")
PROJECT = Path(__file__).resolve().parents[3]


class _Ruleset(ctypes.Structure):
    _fields_ = (("handled", ctypes.c_uint64),)


class _PathRule(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed", ctypes.c_uint64), ("folder", ctypes.c_int32))


def see_only(readable: Iterable[str] = ()) -> bool:
    """Leave this process what Python needs to read; False where the kernel cannot.

    readable: further folders it may read. The process must have given up new privileges before.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    handled = _Ruleset(EVERYTHING)
    rules = libc.syscall(CREATE_RULESET, ctypes.byref(handled), ctypes.sizeof(handled), 0)
    if rules < 0:
        return False
    try:
        for path in {*SYSTEM, *OWN_PROCESS, *_pythons_own(), *readable}:
            _allow(libc, rules, path, READ_FILE | READ_FOLDER)
        _allow(libc, rules, os.devnull, READ_FILE | WRITE_FILE)
        return bool(libc.syscall(RESTRICT_SELF, rules, 0) == 0)
    finally:
        os.close(rules)


def _pythons_own() -> set[str]:
    libraries = os.environ.get("LD_LIBRARY_PATH", "").split(":")
    project = (str(PROJECT / part) for part in PROJECT_PARTS)
    return {path for path in (*sys.path, sys.prefix, sys.base_prefix, *libraries, *project) if path}


def _allow(libc: ctypes.CDLL, rules: int, path: str, rights: int) -> None:
    """Add one rule; a path that is not there needs none."""
    try:
        opened = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        if not Path(path).is_dir():
            rights &= ~READ_FOLDER
        rule = _PathRule(rights, opened)
        if libc.syscall(ADD_RULE, rules, PATH_BENEATH, ctypes.byref(rule), 0) != 0:
            raise OSError(ctypes.get_errno(), "a Landlock rule was refused", path)
    finally:
        os.close(opened)
