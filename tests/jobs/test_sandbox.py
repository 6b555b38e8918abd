"""A confined child: every way it can end has one word, and nothing of it is left behind."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from lubdub.jobs import filesystem, frames
from lubdub.jobs.confinement import protection
from lubdub.jobs.sandbox import ChildResult, Limits, Task, run_in_child
from tests.jobs import sandbox_tasks as tasks

SMALL = Limits(memory_mb=1024, cpu_s=20, wall_s=60, open_files=64)


def ignore(stage: str, fraction: float) -> None:
    """A listener that does not listen."""


def run(task: Task, payload: bytes = b"", limits: Limits = SMALL) -> ChildResult:
    return run_in_child(task, payload, limits, ignore)


def open_descriptors() -> set[tuple[str, str]]:
    """Each open descriptor of this process, with what it leads to."""
    found = set()
    for descriptor in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):  # the one that this reading had open itself
            found.add((descriptor.name, os.readlink(descriptor)))
    return found


def children_of_this_process() -> list[str]:
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()


def is_alive(pid: int) -> bool:
    """Whether the process runs; a zombie waiting for a foreign parent does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


def wait_until(condition: Callable[[], bool]) -> None:
    while not condition():  # pytest's own timeout ends a wait that is in vain
        time.sleep(0.02)


@pytest.fixture(autouse=True)
def nothing_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    protection()
    # Other tests of this process may have left services that live on, or files that are closed only now.
    before, elsewhere = open_descriptors(), children_of_this_process()
    yield
    assert open_descriptors() <= before
    assert [child for child in children_of_this_process() if child not in elsewhere] == []
    assert list(tmp_path.iterdir()) == []


def test_the_answer_and_the_progress_come_back_whole() -> None:
    heard: list[tuple[str, float]] = []
    payload = os.urandom(5_000_000)
    result = run_in_child(tasks.echo, payload, SMALL, lambda stage, fraction: heard.append((stage, fraction)))
    assert result == ChildResult("ok", payload)
    assert heard == [("read", 0.25), ("fit", 0.75)]


def test_an_unreadable_scan_gives_its_sentence() -> None:
    result = run(tasks.unreadable)
    assert (result.status, result.detail) == ("unreadable", "This is no scan. Send another.")
    assert json.loads(result.payload)["code"] == "unreadable_file"


def test_a_refused_scan_gives_its_reason() -> None:
    result = run(tasks.refused)
    assert (result.status, result.detail) == ("refused", "The scan is mirrored.")
    reason = json.loads(result.payload)
    assert reason == {"code": "mirrored_scan", "message": "The scan is mirrored.", "advice": "Scan again."}


@pytest.mark.parametrize("task", [tasks.fail, tasks.leave])
def test_an_unforeseen_fault_goes_to_the_log_and_not_to_the_person(
    task: Task, caplog: pytest.LogCaptureFixture
) -> None:
    result = run(task)
    assert result.status == "error"
    assert "Traceback" not in result.detail
    assert "secret" not in result.detail
    assert "Traceback" in caplog.text


@pytest.mark.parametrize("task", [tasks.crash, tasks.vanish, tasks.abort])
def test_a_child_that_dies_without_an_answer_has_crashed(task: Task) -> None:
    assert run(task).status == "crashed"


def test_four_gibibytes_are_refused() -> None:
    assert run(tasks.allocate, str(4 * 2**30).encode(), Limits()).status == "memory"


def test_the_work_of_a_large_fit_has_room() -> None:
    assert run(tasks.allocate, str(600 * 2**20).encode(), Limits()) == ChildResult("ok", str(600 * 2**20).encode())


def test_an_endless_computation_ends_at_its_share_of_processor_time() -> None:
    result = run(tasks.compute_for_ever, limits=Limits(cpu_s=1, wall_s=60))
    assert result.status == "timeout"
    assert "1 s of computing" in result.detail


def test_a_child_that_waits_for_ever_ends_at_the_wall_clock_limit() -> None:
    assert run(tasks.hang, limits=Limits(wall_s=0.5)).status == "timeout"


def test_a_cancelled_child_ends() -> None:
    wish = threading.Event()
    result = run_in_child(tasks.hang, b"", SMALL, lambda stage, fraction: wish.set(), wish.is_set)
    assert result.status == "cancelled"


def test_a_listener_that_fails_does_not_leave_the_child_running() -> None:
    def listener(stage: str, fraction: float) -> None:
        raise RuntimeError("the listener fell over")

    with pytest.raises(RuntimeError, match="fell over"):
        run_in_child(tasks.hang, b"", SMALL, listener)


def test_only_a_few_files_can_be_open() -> None:
    assert run(tasks.open_many_files).status == "error"


def test_the_child_cannot_reach_a_server_of_this_machine() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        result = run(tasks.call_out, str(server.getsockname()[1]).encode())
    assert (result.status == "error") is protection().no_network


def test_the_child_has_no_powers_over_identities() -> None:
    assert run(tasks.become_root).status == "error"


def test_the_child_holds_nothing_of_its_parent_open(tmp_path: Path) -> None:
    secret = tmp_path / "key"
    secret.write_text("secret")
    try:
        with secret.open():
            held = json.loads(run(tasks.list_descriptors).payload)
    finally:
        secret.unlink()
    assert str(secret) not in held
    assert set(held[:3]) == {os.devnull}


def test_the_child_can_read_only_what_it_was_given(tmp_path: Path) -> None:
    given, secret = tmp_path / "given", tmp_path / "secret"
    try:
        for folder in (given, secret):
            folder.mkdir()
            (folder / "file").write_text(folder.name)
        limits = replace(SMALL, readable=(str(given),))
        assert run(tasks.read_a_file, bytes(given / "file"), limits) == ChildResult("ok", b"given")
        if see_only_is_possible():
            assert run(tasks.read_a_file, bytes(secret / "file"), limits).status == "error"
            assert run(tasks.overwrite_a_file, bytes(given / "file"), limits).status == "error"
            assert (given / "file").read_text() == "given"
    finally:
        shutil.rmtree(given)
        shutil.rmtree(secret)


def see_only_is_possible() -> bool:
    """Whether this kernel has Landlock: it answers with the version it knows."""
    return ctypes.CDLL(None).syscall(filesystem.CREATE_RULESET, None, 0, 1) > 0


def test_what_libraries_print_does_not_reach_our_output(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(tasks.chatter) == ChildResult("ok", b"quiet")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "nonsense",
    [
        b"hello parent, I am not a frame",
        frames.HEADER.pack(frames.Kind.RESULT, 2**40),
        frames.HEADER.pack(frames.Kind.PROGRESS, 4) + b"null",
        frames.HEADER.pack(frames.Kind.PROGRESS, 13) + b'["fit", true,',
        frames.HEADER.pack(frames.Kind.PROGRESS, 10) + b'["a", NaN]',
        frames.HEADER.pack(99, 0),
        frames.HEADER.pack(frames.Kind.RESULT, 0) * 2,
    ],
)
def test_a_child_that_speaks_nonsense_is_ended(nonsense: bytes) -> None:
    assert run(tasks.speak_nonsense, nonsense).status == "crashed"


def test_an_answer_over_the_cap_is_an_error() -> None:
    assert run(tasks.answer_too_much).status == "error"


def test_children_of_several_threads_do_not_disturb_each_other() -> None:
    answers: dict[int, ChildResult] = {}

    def one(number: int) -> None:
        answers[number] = run(tasks.echo, str(number).encode() * 100_000)

    threads = [threading.Thread(target=one, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == {number: ChildResult("ok", str(number).encode() * 100_000) for number in range(6)}


def test_linear_algebra_works_on_the_other_side_of_a_fork() -> None:
    assert tasks.solve(b"", ignore) == run(tasks.solve).payload
