"""`./lubdub benchmark hostile`: thousands of damaged files through the real sandboxed child.

Every file is read there, many to a child; when a child does not come back, its files are read again one by one. Of
those taken some go through the whole check besides, as a worker does it. A verdict is wrong when a file is taken
although its surface is neither the undamaged one (within 0.5 mm) nor what a second reader finds in the same bytes; a
file that stays sound, and says another shape, says nothing else to anybody.
"""

from __future__ import annotations

import atexit
import functools
import json
import time
from collections import Counter
from collections.abc import Iterable, Sequence

from lubdub.jobs.bundle import Bundle
from lubdub.jobs.forkserver import ForkServer, ForkServerFailed
from lubdub.jobs.sandbox import ChildResult, Limits
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.mutants import DAMAGES, mutant, originals

BATCH = 100
FULL_EVERY = 53
"""Of the taken files, those whose number it divides: no kind of damage is left out."""
READ_LIMITS = Limits(memory_mb=2048, cpu_s=60, wall_s=300)
FULL_LIMITS = Limits(cpu_s=300, wall_s=900)
FACTS = {
    **{"age_years": 30.0, "sex": "female", "posture": "supine", "answers": {}, "unit": "mm"},
    **{"method": "lubdub", "landmarks": {}, "references": None},
}
READ, CHECK = "tests.benchmark.hostile_child:read_all", "lubdub.jobs.tasks:examine_task"
TAKEN = ("same", "other")
RIGHT = ("refused", *TAKEN)
ENDS_OF_A_CHECK = ("ok", "refused", "unreadable")


@functools.cache
def reader() -> ForkServer:
    """The warm process that a worker has; started once."""
    server = ForkServer(["lubdub.jobs.tasks:warm_up", "tests.benchmark.hostile_child", "trimesh", "pypcd4"])
    server.start()
    atexit.register(server.stop)
    return server


def _units(size: int, seed: int) -> Iterable[Unit]:
    kinds = list(originals())
    for kind in kinds:
        for first in range(0, -(-size // len(kinds)), BATCH):
            count = min(BATCH, -(-size // len(kinds)) - first)
            yield Unit(f"{kind} {first}", functools.partial(_work, seed, kind, first, count))


def _work(seed: int, kind: str, first: int, count: int) -> list[Row]:
    numbers = range(first, first + count)
    rows = read_batch(seed, kind, numbers)
    for row in rows:
        if row["verdict"] in TAKEN and row["number"] % FULL_EVERY == 0:
            row |= _checked(seed, kind, row["number"])
    return rows


def read_batch(seed: int, kind: str, numbers: Sequence[int]) -> list[Row]:
    """A row for each file, in one child when it comes back, else in a child for each."""
    ended, died = _in_child(READ, _letter(seed, kind, numbers), READ_LIMITS)
    if ended is not None and ended.status == "ok":
        told = {number: (verdict, ms) for number, verdict, ms in json.loads(ended.payload)}
        return [_row(seed, kind, number, *told[number]) for number in numbers]
    if len(numbers) == 1:
        return [_row(seed, kind, numbers[0], "worker died" if ended is None else ended.status, None)]
    rows = [row for number in numbers for row in read_batch(seed, kind, [number])]
    if died:
        rows[0]["worker_deaths"] = 1
    return rows


def _row(seed: int, kind: str, number: int, verdict: str, milliseconds: float | None) -> Row:
    how = mutant(seed, kind, number).how
    return {"kind": kind, "number": number, "how": how, "verdict": verdict, "milliseconds": milliseconds}


def _letter(seed: int, kind: str, numbers: Sequence[int]) -> bytes:
    parts = {str(number): mutant(seed, kind, number).data for number in numbers}
    return Bundle({"kind": kind}, {"original": originals()[kind], **parts}).to_bytes()


def _checked(seed: int, kind: str, number: int) -> Row:
    started = time.perf_counter()
    scan = Bundle(FACTS, {"scan": mutant(seed, kind, number).data}).to_bytes()
    ended, died = _in_child(CHECK, scan, FULL_LIMITS)
    row: Row = {"check": "worker died" if ended is None else ended.status}
    return row | {"check_s": round(time.perf_counter() - started, 1), "worker_deaths": int(died)}


def _in_child(task: str, letter: bytes, limits: Limits) -> tuple[ChildResult | None, bool]:
    """How the child ended, None when the worker's process died with it; and whether that process is another one now."""
    server = reader()
    before = server.pid
    try:
        ended = server.run(task, letter, limits, lambda stage, fraction: None)
    except ForkServerFailed:
        server.start()
        return None, True
    return ended, server.pid != before


COLUMNS = (
    *("kind of file", "files", "refused in a sentence", "as before", "sound, another shape", "wrong verdicts"),
    *("crashes of the child", "over a limit", "whole checks", "slowest, ms"),
)


def line(name: str, rows: Sequence[Row]) -> tuple[Cell, ...]:
    """One line of the table."""
    count = Counter(row["verdict"] for row in rows)
    heavy = count["memory"] + count["timeout"]
    checks = sum("check" in row for row in rows)
    slowest = max((row["milliseconds"] for row in rows if row["milliseconds"] is not None), default=None)
    crashed = len(crashes(rows))
    return (
        *(name, len(rows), count["refused"], count["same"], count["other"], len(wrong(rows)), crashed, heavy, checks),
        slowest,
    )


def crashes(rows: Sequence[Row]) -> list[Row]:
    """Files that ended their child."""
    return [row for row in rows if "crashed" in (row["verdict"], row.get("check"))]


def wrong(rows: Sequence[Row]) -> list[Row]:
    """Files with a verdict that a person must not get: taken for what they are not, or an error of ours."""
    known = (*RIGHT, "crashed", "memory", "timeout", "worker died")
    return [
        row
        for row in rows
        if row["verdict"] not in known or row.get("check", "ok") not in (*ENDS_OF_A_CHECK, *known[3:])
    ]


def report(rows: list[Row]) -> Report:
    """`worker_deaths` and `wrong_verdicts` must be 0."""
    of_kind = {kind: [row for row in rows if row["kind"] == kind] for kind in originals()}
    of_damage = {how: [row for row in rows if row["how"] == how] for how in DAMAGES}
    slowest = max(rows, key=lambda row: row["milliseconds"] or 0.0)
    deaths = sum(row.get("worker_deaths") or 0 for row in rows)
    found = [(row["kind"], row["number"], row["how"], row["verdict"]) for row in (*crashes(rows), *wrong(rows))]
    tables = (
        Table("By kind of file", COLUMNS, [*(line(*one) for one in of_kind.items()), line("all", rows)]),
        Table("By kind of damage", COLUMNS, [line(*one) for one in of_damage.items()]),
        Table("Crashes and wrong verdicts", ("kind of file", "number", "damage", "verdict"), found),
    )
    checks = Counter(row["check"] for row in rows if "check" in row)
    numbers = {
        "worker_deaths": deaths,
        "wrong_verdicts": len(wrong(rows)),
        "child_crashes": len(crashes(rows)),
        "whole_checks": dict(checks),
        "slowest": {name: slowest[name] for name in ("kind", "number", "how", "milliseconds")},
    }
    return Report(tables, numbers, words=_words(numbers))


def _words(numbers: Row) -> str:
    slow = numbers["slowest"]
    checks = ", ".join(f"{count} {word}" for word, count in sorted(numbers["whole_checks"].items()))
    return (
        f"# Hostile files\n\n{__doc__.split(chr(10) * 2, 1)[1].strip() if __doc__ else ''}\n\n"
        f"Deaths of the worker: **{numbers['worker_deaths']}**. Wrong verdicts: **{numbers['wrong_verdicts']}**. "
        f"Crashes of the child: **{numbers['child_crashes']}**. Slowest file: {slow['kind']} number {slow['number']} "
        f"({slow['how']}), {slow['milliseconds']} ms with the second reader. Whole checks of "
        f"taken files: {checks or 'none'}."
    )


HOSTILE = Experiment(
    "hostile",
    "damaged files of every kind: does any crash the worker, or pass for what it is not?",
    20_000,
    "how many files",
    _units,
    report,
)
