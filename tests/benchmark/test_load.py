"""The report of the load's benchmark, and how it watches processes and counts waits."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import Any

import pytest

from tests.benchmark import load
from tests.benchmark.experiment import Row
from tests.benchmark.load_parts import kind_of
from tests.benchmark.load_service import paced
from tests.benchmark.load_watch import growth, machine_worked_s, percentiles_ms, taken_by, worked_s
from tests.web.service import eventually


def rows(**changes: Any) -> list[Row]:
    said = {"two": 19.0, "p99": 40.0, "last_mb": 500.0, "lost": 0} | changes
    soak = [{"memory_mb": 500.0, "descriptors": 90, "sockets": 40, "threads": 30, "processes": 5} for _ in range(8)]
    soak[-1]["memory_mb"] = soak[-2]["memory_mb"] = said["last_mb"]
    return [
        {"part": "cases", "workers": 1, "cases": 10, "seconds": 50.0},
        {"part": "cases", "workers": 2, "cases": 10, "seconds": 600 / said["two"] - 10.0},
        {"part": "cases", "workers": 1, "cases": 10, "seconds": 70.0},
        {"part": "cases", "workers": 2, "cases": 10, "seconds": 600 / said["two"] + 10.0},
        {"part": "latency", "workers": "idle", "p99_ms": 900.0},
        {"part": "latency", "workers": "busy", "p99_ms": said["p99"]},
        {"part": "streams", "streams": 200},
        {"part": "views", "views": 50},
        {"part": "tenfold", "lost": said["lost"]},
        *({"part": "soak", "second": 60 * number, "cases": number, **row} for number, row in enumerate(soak)),
    ]


def promised(**changes: Any) -> dict[str, Any]:
    return {line[0]: line[-1] for line in load.report(rows(**changes)).tables[0].rows}


def test_what_was_kept_is_said() -> None:
    assert set(promised().values()) == {"yes"}


@pytest.mark.parametrize(
    ("changes", "broken"),
    [
        ({"two": 17.0}, "two workers over one"),
        ({"p99": 101.0}, "p99 while jobs run, ms"),
        ({"last_mb": 560.0}, "memory's growth in the soak"),
        ({"lost": 1}, "accepted and lost at tenfold load"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_was_not_kept_is_said(changes: dict[str, Any], broken: str) -> None:
    assert [name for name, is_kept in promised(**changes).items() if is_kept == "no"] == [broken]


def test_idle_workers_do_not_count_for_the_promise_about_busy_ones() -> None:
    assert promised()["p99 while jobs run, ms"] == "yes"


def test_every_part_is_a_unit_of_its_own_and_the_soak_says_how_long() -> None:
    keys = [unit.key for unit in load.LOAD.units(60, 1)]
    assert len(set(keys)) == len(keys)
    assert keys[-1] == "soak of 60 minutes"


@pytest.mark.parametrize(
    ("status", "retry_after", "kind"),
    [
        (202, None, "accepted"),
        (429, "3", "turned away"),
        (503, "3", "turned away"),
        (429, None, "turned away without a word"),
        (500, "3", "failed"),
        (404, None, "failed"),
    ],
)
def test_only_an_answer_that_says_when_to_come_back_turns_away_well(
    status: int, retry_after: str | None, kind: str
) -> None:
    assert kind_of(status, retry_after) == kind


def test_a_wait_is_counted_from_the_moment_the_call_was_due() -> None:
    slow = iter([0.3, *[0.0] * 5])
    took = paced([lambda: time.sleep(next(slow))], 6, 20.0)
    assert took[0] >= 0.3
    assert took[1] >= 0.2  # it was due 0.05 s after the first, and waited for it


def test_memory_files_and_children_of_a_process_are_counted() -> None:
    child = "import subprocess, sys; p = subprocess.Popen([sys.executable, '-c', 'input()'], stdin=0); p.wait()"
    with subprocess.Popen([sys.executable, "-c", child], stdin=subprocess.PIPE) as process:
        eventually(lambda: taken_by([process.pid]).processes == 2)
        taken = taken_by([process.pid])
        assert taken.memory_mb > 5
        assert taken.descriptors >= 6
        process.communicate(b"\n")
    assert taken_by([process.pid]).processes == 0


def test_sockets_are_told_from_files() -> None:
    def with_open(what: str) -> tuple[int, int]:
        program = f"import os, socket; one = {what}; print('there', flush=True); input()"
        with subprocess.Popen(
            [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as process:
            assert process.stdout is not None
            process.stdout.readline()
            taken = taken_by([process.pid])
            process.communicate(b"\n")
        return taken.descriptors, taken.sockets

    (nothing, none), (socket, one), (file, no) = map(with_open, ("0", "socket.socket()", "open(os.devnull)"))
    assert (socket - nothing, one - none) == (1, 1)
    assert (file - nothing, no - none) == (1, 0)


def test_work_of_children_that_have_ended_counts_too() -> None:
    before = worked_s([os.getpid()])
    subprocess.run([sys.executable, "-c", "sum(range(3_000_000))"], check=True)
    assert worked_s([os.getpid()]) > before


def test_the_machines_work_holds_that_of_every_process() -> None:
    machine, ours = machine_worked_s(), worked_s([os.getpid()])
    subprocess.run([sys.executable, "-c", "sum(range(10_000_000))"], check=True)
    assert machine_worked_s() - machine >= 0.9 * (worked_s([os.getpid()]) - ours) > 0


def test_the_first_quarter_warms_up_and_does_not_count_as_growth() -> None:
    assert growth([100, 100, 500, 500, 500, 500, 520, 520]) == (500, 520)


def test_percentiles_are_in_milliseconds() -> None:
    told = percentiles_ms([0.001] * 99 + [1.0])
    assert (told["calls"], told["p50_ms"], told["most_ms"]) == (100, 1.0, 1000.0)
