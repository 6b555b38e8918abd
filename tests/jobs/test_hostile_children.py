"""Code that a hostile file smuggled into the reader finds every door shut, and does not get out alive."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from lubdub.jobs.confinement import protection
from lubdub.jobs.sandbox import ChildResult, Limits, Task, run_in_child
from tests.jobs import hostile_tasks as attempts

LIMITS = Limits(memory_mb=1024, cpu_s=20, wall_s=60)
needs_filter = pytest.mark.skipif(
    not protection().no_other_processes, reason="this kernel cannot refuse system calls to a process (no seccomp)"
)
needs_landlock = pytest.mark.skipif(
    not protection().other_files_hidden, reason="this kernel cannot hide files from a process (no Landlock)"
)


def attempt(task: Task, about: Path | int = 0) -> ChildResult:
    return run_in_child(task, os.fsencode(str(about)), LIMITS, lambda stage, fraction: None)


@pytest.fixture
def secret(tmp_path: Path) -> Iterator[Path]:
    """Another person's file, which must be as it was in the end."""
    path = tmp_path / "secret"
    path.write_text("somebody else's scan")
    yield path
    assert path.read_text() == "somebody else's scan"
    assert list(tmp_path.iterdir()) == [path]
    assert path.stat().st_mode & 0o600 == 0o600


@needs_filter
@pytest.mark.parametrize(
    "task",
    [
        attempts.start_a_program,
        attempts.start_processes_for_ever,
        attempts.start_a_process_past_the_library,
    ],
)
def test_a_file_that_starts_processes_gets_none(task: Task, caplog: pytest.LogCaptureFixture) -> None:
    assert attempt(task).status == "error"
    assert "PermissionError" in caplog.text


def test_a_file_that_starts_threads_for_ever_comes_to_an_end() -> None:
    assert attempt(attempts.start_threads_for_ever).status in ("error", "memory", "crashed")


@needs_filter
@pytest.mark.parametrize(
    "task",
    [
        attempts.kill_the_parent,
        attempts.kill_a_thread_of_the_parent,
        attempts.starve_the_parent,
        attempts.have_the_kernel_signal_the_parent,
    ],
)
def test_a_file_cannot_take_the_worker_down(task: Task, caplog: pytest.LogCaptureFixture) -> None:
    assert attempt(task).status == "error"
    assert "PermissionError" in caplog.text


@pytest.mark.skipif(not protection().no_network, reason="the network cannot be taken from a process here")
def test_a_file_that_opens_sockets_reaches_nobody() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        assert attempt(attempts.connect, server.getsockname()[1]).status == "error"


@needs_filter
def test_a_file_cannot_even_make_a_socket_to_a_program_of_this_machine() -> None:
    assert attempt(attempts.open_a_local_socket).status == "error"


@pytest.mark.parametrize("folder", ["/tmp", "/dev/shm", "/var/tmp", "."])
def test_a_file_that_fills_the_disk_writes_not_a_byte(folder: str) -> None:
    place = Path(folder).absolute()
    try:
        assert attempt(attempts.write_a_file, place).status == "error"
    finally:
        left = place / "mine"
        size = left.stat().st_size if left.exists() else 0
        left.unlink(missing_ok=True)
    assert size == 0


@needs_filter
@pytest.mark.parametrize("task", [attempts.hide_memory_in_a_file, attempts.hide_memory_in_a_shared_segment])
def test_a_file_cannot_eat_memory_that_outlives_it(task: Task, caplog: pytest.LogCaptureFixture) -> None:
    assert attempt(task).status == "error"
    assert "PermissionError" in caplog.text


@needs_landlock
@pytest.mark.parametrize("task", [attempts.read, attempts.list_a_folder])
def test_a_file_cannot_read_other_files_of_the_machine(task: Task, secret: Path) -> None:
    assert attempt(task, secret).status == "error"


@needs_landlock
def test_a_file_cannot_read_what_the_worker_was_told_in_its_environment() -> None:
    assert attempt(attempts.read_the_parents_environment).status == "error"


@needs_landlock
def test_a_file_cannot_overwrite_other_files(secret: Path) -> None:
    assert attempt(attempts.overwrite, secret).status == "error"


@needs_filter
@pytest.mark.parametrize(
    "task", [attempts.empty, attempts.remove, attempts.rename, attempts.lock_everybody_out, attempts.make_a_folder]
)
def test_a_file_cannot_change_what_lies_on_the_disk(task: Task, secret: Path) -> None:
    about = secret.parent if task is attempts.make_a_folder else secret
    assert attempt(task, about).status == "error"


def test_a_file_does_not_become_another_user() -> None:
    assert attempt(attempts.become_root).status == "error"
