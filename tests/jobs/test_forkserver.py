"""Warm children: the same promises as the sandbox, and a server that lives exactly as long as it is needed."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from lubdub.jobs.confinement import protection
from lubdub.jobs.forkserver import ForkServer, ForkServerFailed
from lubdub.jobs.priority import NICENESS
from lubdub.jobs.sandbox import ChildResult, Limits
from tests.jobs.test_sandbox import ignore, is_alive, open_descriptors, wait_until

TASKS = "tests.jobs.sandbox_tasks"
LIMITS = Limits(cpu_s=20, wall_s=60)


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    running = ForkServer(["open3d", f"{TASKS}:warm_up"])
    running.start()
    yield running
    running.stop()


def run(server: ForkServer, task: str, payload: bytes = b"", limits: Limits = LIMITS) -> ChildResult:
    return server.run(f"{TASKS}:{task}", payload, limits, ignore)


def test_the_answer_and_the_progress_come_back_whole(server: ForkServer) -> None:
    heard: list[tuple[str, float]] = []
    payload = os.urandom(5_000_000)
    result = server.run(f"{TASKS}:echo", payload, LIMITS, lambda stage, fraction: heard.append((stage, fraction)))
    assert result == ChildResult("ok", payload)
    assert heard == [("read", 0.25), ("fit", 0.75)]


def test_children_find_what_was_warmed_up(server: ForkServer) -> None:
    assert json.loads(run(server, "say_whether_warm").payload) == ["warm"]


@pytest.mark.parametrize(
    ("task", "status"),
    [
        ("unreadable", "unreadable"),
        ("refused", "refused"),
        ("fail", "error"),
        ("crash", "crashed"),
        ("vanish", "crashed"),
        ("answer_too_much", "error"),
        ("no_such_task", "error"),
        ("open_many_files", "error"),
        ("become_root", "error"),
    ],
)
def test_every_way_a_child_ends_has_its_word(server: ForkServer, task: str, status: str) -> None:
    assert run(server, task).status == status
    assert run(server, "echo", b"and the server goes on").status == "ok"


def test_the_memory_limit_leaves_room_for_work_on_top_of_the_warm_libraries(server: ForkServer) -> None:
    assert run(server, "allocate", str(4 * 2**30).encode()).status == "memory"
    assert run(server, "allocate", str(600 * 2**20).encode()).status == "ok"
    assert run(server, "allocate", str(600 * 2**20).encode(), Limits(memory_mb=500)).status == "memory"


def test_time_limits_end_a_warm_child(server: ForkServer) -> None:
    assert run(server, "hang", limits=Limits(wall_s=0.5)).status == "timeout"
    assert run(server, "compute_for_ever", limits=Limits(cpu_s=1)).status == "timeout"


def test_a_cancelled_child_ends_and_the_server_goes_on(server: ForkServer) -> None:
    pids: list[int] = []
    result = server.run(
        f"{TASKS}:own_pid_then_hang",
        b"",
        LIMITS,
        lambda stage, fraction: pids.append(int(stage)),
        lambda: bool(pids),
    )
    assert result.status == "cancelled"
    assert not is_alive(pids[0])
    assert run(server, "echo").status == "ok"


def test_a_child_gives_way_to_pages_however_the_kernel_shares_out_processors(server: ForkServer) -> None:
    seen: list[tuple[int, str]] = []

    def look(stage: str, fraction: float) -> None:
        session = Path(f"/proc/{stage}/autogroup")
        seen.append((os.getpriority(os.PRIO_PROCESS, int(stage)), session.read_text() if session.exists() else ""))

    server.run(f"{TASKS}:own_pid_then_hang", b"", LIMITS, look, lambda: bool(seen))
    ((niceness, session),) = seen
    assert niceness == os.getpriority(os.PRIO_PROCESS, 0) + NICENESS
    assert not session or session.endswith(f" nice {NICENESS}\n")


def test_the_child_cannot_reach_a_server_of_this_machine(server: ForkServer) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        result = run(server, "call_out", str(listener.getsockname()[1]).encode())
    assert (result.status == "error") is protection().no_network


def test_several_threads_are_served_at_once(server: ForkServer) -> None:
    """Each child waits until all have started: it only ends when they truly run side by side."""
    together = threading.Barrier(4, timeout=60)
    results: list[str] = []

    def one() -> None:
        met = threading.Event()

        def listener(stage: str, fraction: float) -> None:
            together.wait()
            met.set()

        results.append(server.run(f"{TASKS}:hang", b"", LIMITS, listener, met.is_set).status)

    threads = [threading.Thread(target=one) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == ["cancelled"] * 4


def test_no_descriptor_and_no_zombie_is_left() -> None:
    server = ForkServer()
    server.start()
    here, fresh = open_descriptors(), descriptors_and_children(server.pid)
    for task in ("echo", "crash", "unreadable"):
        run(server, task)
    run(server, "hang", limits=Limits(wall_s=0.2))
    assert open_descriptors() <= here
    # The server tidies up just after it has told us how the child ended.
    wait_until(lambda: descriptors_and_children(server.pid) == fresh)
    server.stop()


def descriptors_and_children(pid: int) -> tuple[int, list[str]]:
    held = len(os.listdir(f"/proc/{pid}/fd"))
    return held, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


def test_linear_algebra_works_in_a_warm_child(server: ForkServer) -> None:
    from tests.jobs.sandbox_tasks import solve

    assert json.loads(run(server, "solve").payload) == pytest.approx(json.loads(solve(b"", ignore)))


def test_a_server_that_died_is_started_again() -> None:
    server = ForkServer()
    server.start()
    first = server.pid
    os.kill(first, signal.SIGKILL)
    assert run(server, "echo", b"again") == ChildResult("ok", b"again")
    assert server.pid != first
    server.stop()


def test_the_death_of_the_server_at_work_is_told_and_takes_the_child_along() -> None:
    server = ForkServer()
    server.start()
    pids: list[int] = []

    def listener(stage: str, fraction: float) -> None:
        pids.append(int(stage))
        os.kill(server.pid, signal.SIGKILL)

    with pytest.raises(ForkServerFailed):
        server.run(f"{TASKS}:own_pid_then_hang", b"", LIMITS, listener)
    wait_until(lambda: not is_alive(pids[0]))
    server.stop()


def test_stopping_ends_everything_and_can_be_repeated() -> None:
    before = open_descriptors()
    server = ForkServer()
    server.start()
    pid = server.pid
    server.stop()
    server.stop()
    assert not is_alive(pid)
    assert open_descriptors() <= before


def test_a_server_that_cannot_import_says_so(capfd: pytest.CaptureFixture[str]) -> None:
    before = open_descriptors()
    with pytest.raises(ForkServerFailed, match="could not start"):
        ForkServer(["no_such_module_anywhere"]).start()
    assert open_descriptors() <= before
    assert "no_such_module_anywhere" in capfd.readouterr().err


def test_the_server_does_not_outlive_a_parent_that_is_killed() -> None:
    program = f"""
import sys
sys.path[:] = {sys.path!r}
from lubdub.jobs.confinement import protection
from lubdub.jobs.forkserver import ForkServer
from lubdub.jobs.sandbox import Limits
server = ForkServer(); server.start()
def listener(stage, fraction):
    print(server.pid, stage, flush=True)
server.run("{TASKS}:own_pid_then_hang", b"", Limits(), listener)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        server_pid, child_pid = (int(word) for word in parent.stdout.readline().split())
        parent.kill()
    wait_until(lambda: not is_alive(server_pid))
    wait_until(lambda: not is_alive(child_pid))


def test_a_server_whose_parent_left_while_it_warmed_up_ends_without_complaint() -> None:
    parent, child = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with child:
        parent.close()
        end = subprocess.run(
            [sys.executable, "-m", "lubdub.jobs.warm_process", str(child.fileno())],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
            pass_fds=(child.fileno(),),
            start_new_session=True,
            capture_output=True,
            text=True,
            check=False,
        )
    assert (end.returncode, end.stderr) == (0, "")
