"""What a running program takes of the machine: memory, files, sockets, threads, processes; it and all its children."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from tests.benchmark.experiment import Row

MB = 1_000_000
PAGE = os.sysconf("SC_PAGE_SIZE")
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Taken:
    """memory_mb: resident, so that what processes share counts for each; descriptors: open files and sockets alike."""

    processes: int
    threads: int
    memory_mb: float
    descriptors: int
    sockets: int

    def to_row(self) -> Row:
        """As it is written."""
        return asdict(self)


def family_of(pid: int) -> list[int]:
    """The process and everything that descends from it."""
    found = [pid]
    for parent in found:
        try:
            lists = [path.read_text() for path in Path(f"/proc/{parent}/task").glob("*/children")]
        except OSError:
            continue  # it has just ended
        found += [int(child) for listed in lists for child in listed.split()]
    return found


def taken_by(pids: Iterable[int]) -> Taken:
    """What these processes and their children take now. One that ends meanwhile is left out."""
    each = [one for pid in pids for member in family_of(pid) if (one := _one(member)) is not None]
    return Taken(
        processes=len(each),
        threads=sum(one.threads for one in each),
        memory_mb=round(sum(one.memory_mb for one in each), 1),
        descriptors=sum(one.descriptors for one in each),
        sockets=sum(one.sockets for one in each),
    )


def _one(pid: int) -> Taken | None:
    folder = Path(f"/proc/{pid}")
    try:
        pages = int((folder / "statm").read_text().split()[1])
        links = [os.readlink(link) for link in (folder / "fd").iterdir()]
        threads = sum(1 for _ in (folder / "task").iterdir())
    except OSError:
        return None
    return Taken(1, threads, pages * PAGE / MB, len(links), sum(link.startswith("socket:") for link in links))


def worked_s(pids: Iterable[int]) -> float:
    """Processor seconds of these processes and their children, also of those that have ended: what the work costs,
    whatever else the machine does."""
    return round(sum(_ticks(member) for pid in pids for member in family_of(pid)) / TICKS, 2)


def _ticks(pid: int) -> int:
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0
    return sum(map(int, words[11:15]))  # own user and system time, and those of children that were waited for


def machine_worked_s() -> float:
    """Seconds that all the machine's cores have worked together since it was started, whoever they worked for."""
    spent = [int(ticks) for ticks in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    idle, waiting_for_disks = spent[3:5]
    return (sum(spent) - idle - waiting_for_disks) / TICKS


def growth(samples: Sequence[float]) -> tuple[float, float]:
    """Medians of the second quarter and of the last quarter: the first quarter warms up."""
    quarter = max(1, len(samples) // 4)
    return float(np.median(samples[quarter : 2 * quarter] or samples)), float(np.median(samples[-quarter:]))


def percentiles_ms(seconds: Sequence[float]) -> dict[str, float]:
    """Half of the waits, and 99 of 100, are no longer than this; and the longest. In milliseconds."""
    told = np.asarray(seconds) * 1000
    return {
        "calls": len(seconds),
        "p50_ms": round(float(np.percentile(told, 50)), 1),
        "p99_ms": round(float(np.percentile(told, 99)), 1),
        "most_ms": round(float(told.max()), 1),
    }
