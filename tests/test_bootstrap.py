"""The first start, on a made-up machine: every tool the script calls is a stand-in that writes down its call."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
REAL_TOOLS = (
    *("awk", "cat", "chmod", "cksum", "dirname", "env", "grep", "ln", "ls", "mkdir", "mv"),
    *("readlink", "rm", "sed", "sleep", "tail", "tr"),
)
LIBRARIES = "libEGL.so.1 libGL.so.1 libX11.so.6 libusb-1.0.so.0 libgomp.so.1 libopenblas.so.0"

PYTHON = r"""
echo "python $*" >>"$CALLS"
case "$1 ${2:-}" in
    "-V "*) echo "Python 3.11.9" ;;
    "-c "*version_info*) exit "${PYTHON_IS_OLD:-0}" ;;
    "-c "*sysconfig*) echo /nowhere ;;
    "-m venv") shift 2; for last in "$@"; do :; done; mkdir -p "$last/bin"; cp_self "$last/bin/python" ;;
    "-m pip")
        case "$*" in *"${PIP_FAILS_AT:-no such call}"*) echo "${PIP_SAYS:-pip is unhappy}"; exit 1 ;; esac
        ;;
    "-m lubdub")
        shift 2
        [ -z "${PYTHONDONTWRITEBYTECODE:-}" ] || echo "bytecode thrown away" >>"$CALLS"
        echo "in $PWD:"
        for word in "$@"; do echo "<$word>"; done
        ;;
    "-m mypy") exit "${MYPY_FAILS:-0}" ;;
    "-m pytest")
        echo "${PYTEST_REPORT:-}" >"${3#--junitxml=}"
        exit "${PYTEST_FAILS:-0}"
        ;;
esac
"""
STAND_INS = {
    "caddy": "exit 0",
    "apt-get": 'echo "apt-get $*" >>"$CALLS"; exit "${APT_FAILS:-0}"',
    "cc": "exit 0",
    "chromium": "exit 0",
    "df": 'echo header; echo "disk 1 1 ${FREE_KB:-9000000} 1% /"',
    "dpkg": "exit 1",
    "id": 'echo "${USER_NUMBER:-0}"',
    "ldconfig": 'echo "${LIBRARIES:-}"',
    "node": "exit 0",
    "postgres": "exit 0",
    "npm": 'echo "npm $* in ${PWD##*/}" >>"$CALLS"; mkdir -p node_modules',
    "sh": 'exec /bin/sh "$@"',
}


@dataclass
class Machine:
    """A computer with a copy of the script. words: what the stand-ins are told."""

    home: Path
    tools: Path
    calls_file: Path
    words: dict[str, str] = field(default_factory=lambda: {"LIBRARIES": LIBRARIES})

    @property
    def script(self) -> Path:
        return self.home / "lubdub"

    def start(self, *words: str, script: Path | None = None, cwd: Path | None = None) -> subprocess.Popen[str]:
        self.calls_file.write_text("")
        return subprocess.Popen(
            [str(script or self.script), *words],
            cwd=cwd or self.home,
            env={"PATH": str(self.tools), "CALLS": str(self.calls_file), **self.words},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *words: str, script: Path | None = None, cwd: Path | None = None) -> tuple[int, str, str]:
        process = self.start(*words, script=script, cwd=cwd)
        out, err = process.communicate()
        return process.returncode, out, err

    def calls(self, word: str) -> list[str]:
        return [line for line in self.calls_file.read_text().splitlines() if word in line]

    def add_tool(self, name: str, body: str) -> None:
        path = self.tools / name
        path.write_text(f"#!/bin/sh\n{body}\n")
        path.chmod(0o755)

    def remove_tool(self, name: str) -> None:
        (self.tools / name).unlink()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    home, tools = tmp_path / "a place" / "lubdub folder", tmp_path / "bin"
    for folder in (home / "frontend", home / "tests" / "peers", home / "backend", tools):
        folder.mkdir(parents=True)
    shutil.copy(ROOT / "lubdub", home)
    for name in ("", "-build", "-solver", "-benchmark", "-dev", "-node", "-compiler"):
        (home / f"requirements{name}.txt").write_text(f"things{name}==1\n")
    for folder in (home / "frontend", home / "tests" / "peers"):
        (folder / "package-lock.json").write_text("{}")
    for name in REAL_TOOLS:
        found = shutil.which(name)
        assert found is not None
        (tools / name).symlink_to(found)
    made = Machine(home, tools, tmp_path / "calls")
    made.add_tool("python3", PYTHON.replace("cp_self", f'cat "{tools}/python3" >"$last/bin/python"; chmod +x'))
    for name, body in STAND_INS.items():
        made.add_tool(name, body)
    return made


def test_the_first_start_sets_up_and_hands_over(machine: Machine) -> None:
    code, out, err = machine.run("locate", "my scan.ply", "--age", "6")
    assert code == 0
    assert out == f"in {machine.home}:\n<locate>\n<my scan.ply>\n<--age>\n<6>\n"
    assert "Installing Python packages" in err
    installed = machine.calls("pip install")
    assert all("--require-hashes" in call for call in installed)
    assert [call.split("/")[-1] for call in installed] == [
        "requirements.txt",
        "requirements-build.txt",
        "requirements-solver.txt",
    ]
    assert machine.calls("npm") == []


def test_a_benchmark_installs_what_only_experiments_need_and_other_commands_do_not(machine: Machine) -> None:
    machine.run("locate")
    assert machine.calls("requirements-benchmark.txt") == []
    code, out, _ = machine.run("benchmark", "cohort")
    assert code == 0
    assert "<cohort>" in out
    assert len(machine.calls("requirements-benchmark.txt")) == 1


def test_the_second_start_hands_over_at_once(machine: Machine) -> None:
    machine.run("serve")
    code, _, err = machine.run("serve")
    assert (code, err) == (0, "")
    assert machine.calls("") == ["python -m lubdub serve"]


def test_what_python_compiled_is_kept_so_that_later_starts_are_quick(machine: Machine) -> None:
    machine.words |= {"PYTHONDONTWRITEBYTECODE": "1"}
    machine.run("serve")
    assert machine.calls("-m lubdub serve") != []
    assert machine.calls("bytecode") == []


def test_only_what_changed_is_set_up_again(machine: Machine) -> None:
    machine.run("serve")
    (machine.home / "frontend" / "package-lock.json").write_text('{"changed": true}')
    machine.run("serve")
    assert [call.split()[0] for call in machine.calls("")] == ["npm", "python"]
    (machine.home / "requirements.txt").write_text("things==2\n")
    machine.run("serve")
    assert len(machine.calls("pip install")) == 1


def test_the_browsers_parts_run_no_scripts_of_strangers(machine: Machine) -> None:
    machine.run("serve")
    assert [call.split("--no-audit")[0] for call in machine.calls("npm")] == ["npm ci --ignore-scripts "]


def test_only_the_tests_fetch_the_programs_they_compare_with(machine: Machine) -> None:
    machine.run("serve")
    assert machine.calls("in peers") == []
    machine.run("test")
    assert len(machine.calls("in peers")) == 1


def test_it_starts_from_any_folder_and_through_links(machine: Machine, tmp_path: Path) -> None:
    (tmp_path / "first link").symlink_to(machine.script)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "second").symlink_to("../first link")
    code, out, _ = machine.run("locate", "x", script=elsewhere / "second", cwd=elsewhere)
    assert (code, out.splitlines()[0]) == (0, f"in {elsewhere}:")
    assert (machine.home / ".venv").is_dir()
    assert not (elsewhere / ".venv").exists()


@pytest.mark.parametrize("words", [["--help"], [], ["locate", "--help"], ["no-such-command"]])
def test_help_needs_no_set_up(machine: Machine, words: list[str]) -> None:
    code, out, err = machine.run(*words)
    assert (code, err) == (0, "")
    assert out.startswith("in ")
    assert not (machine.home / ".venv").exists()
    assert not (machine.home / ".system").exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ({"PYTHON_IS_OLD": "1"}, "Python 3.11 or newer is missing"),
        ({"FREE_KB": "500000"}, "Only 500 MB are free"),
        ({"PIP_FAILS_AT": "install", "PIP_SAYS": "OSError: [Errno 28] No space left on device"}, "disk is full"),
        ({"PIP_FAILS_AT": "install", "PIP_SAYS": "Temporary failure in name resolution"}, "network did not answer"),
        ({"PIP_FAILS_AT": "install", "PIP_SAYS": "hashes do not match"}, "The lines above say why"),
        ({"LIBRARIES": "", "APT_FAILS": "100"}, "system packages could not be installed"),
    ],
)
def test_what_stops_the_first_start_is_said_clearly(machine: Machine, words: dict[str, str], sentence: str) -> None:
    machine.words |= words
    code, out, err = machine.run("locate", "x")
    assert (code, out) == (1, "")
    assert sentence in err.splitlines()[-1]
    assert not os.path.lexists(machine.home / ".system" / "lock")


def test_after_a_failure_it_goes_on_where_it_stopped(machine: Machine) -> None:
    machine.words["PIP_FAILS_AT"] = "requirements.txt"
    assert machine.run("locate", "x")[0] == 1
    assert len(machine.calls("-m venv")) == 1
    del machine.words["PIP_FAILS_AT"]
    assert machine.run("locate", "x")[0] == 0
    assert machine.calls("-m venv") == []
    assert len(machine.calls("pip install")) == 3


def test_a_missing_python_is_said_clearly(machine: Machine) -> None:
    machine.remove_tool("python3")
    code, _, err = machine.run("--no-system", "serve")
    assert code == 1
    assert "apt-get install python3 python3-venv" in err.splitlines()[-1]


def test_without_the_solver_it_goes_on_and_tries_again_only_when_asked(machine: Machine) -> None:
    machine.words["PIP_FAILS_AT"] = "requirements-solver.txt"
    code, out, err = machine.run("locate", "x")
    assert (code, out.splitlines()[1]) == (0, "<locate>")
    assert "SuperLU" in err
    machine.run("locate", "x")
    assert machine.calls("pip") == []
    del machine.words["PIP_FAILS_AT"]
    machine.run("setup")
    assert len(machine.calls("requirements-solver.txt")) == 1


def test_root_installs_system_packages_by_apt(machine: Machine) -> None:
    machine.words["LIBRARIES"] = LIBRARIES.replace("libEGL.so.1", "")
    machine.run("locate", "x")
    assert "apt-get -q update" in machine.calls("apt-get")
    assert "install -y --no-install-recommends libegl1" in machine.calls("apt-get")[1]


def test_a_user_with_sudo_installs_them_that_way(machine: Machine) -> None:
    machine.words |= {"LIBRARIES": "", "USER_NUMBER": "1000"}
    machine.add_tool("sudo", 'echo "sudo $*" >>"$CALLS"; [ "$2" = true ] || { shift; exec "$@"; }')
    assert machine.run("locate", "x")[0] == 0
    assert "sudo -n true" in machine.calls("sudo -n")
    assert any("sudo -n env DEBIAN_FRONTEND=noninteractive apt-get" in call for call in machine.calls("sudo -n"))
    assert len(machine.calls("apt-get -q")) >= 2


def test_a_user_without_rights_gets_the_packages_unpacked_here(machine: Machine) -> None:
    machine.words |= {"LIBRARIES": "", "USER_NUMBER": "1000"}
    machine.add_tool(
        "apt-get",
        'echo "apt-get $*" >>"$CALLS"\n'
        'case "$*" in *" -s "*) echo "Inst libegl1 (1.0)" ;; *download*) : >libegl1.deb ;; esac',
    )
    machine.add_tool("dpkg-deb", 'echo "dpkg-deb $*" >>"$CALLS"; mkdir -p "$3/usr/lib/x86_64-linux-gnu"')
    code, _, err = machine.run("locate", "x")
    assert code == 0
    assert "unpacking the system packages into .system" in err
    assert all("Dir::State=" in call for call in machine.calls("apt-get"))
    assert (machine.home / ".system/usr/lib/x86_64-linux-gnu").is_dir()


def test_a_user_without_rights_or_packages_is_told_what_would_help(machine: Machine) -> None:
    machine.words |= {"LIBRARIES": "", "USER_NUMBER": "1000", "APT_FAILS": "100"}
    code, _, err = machine.run("locate", "x")
    assert code == 0
    assert "An administrator can help with: apt-get install --no-install-recommends libegl1" in err


def test_no_system_only_says_what_would_help(machine: Machine) -> None:
    machine.words["LIBRARIES"] = ""
    code, _, err = machine.run("--no-system", "locate", "x")
    assert code == 0
    assert "These would help: apt-get install --no-install-recommends libegl1" in err
    assert machine.calls("apt-get") == []


def test_a_machine_without_node_gets_it_from_the_package_index(machine: Machine) -> None:
    machine.remove_tool("npm")
    machine.remove_tool("node")
    code, _, err = machine.run("serve")
    assert code == 1  # the stand-in for pip brings no npm along, so nothing can follow
    assert "No Node.js here" in err
    assert len(machine.calls("requirements-node.txt")) == 1
    assert "--require-hashes" in machine.calls("requirements-node.txt")[0]


def test_a_lock_left_by_a_dead_process_is_no_obstacle(machine: Machine) -> None:
    (machine.home / ".system").mkdir()
    (machine.home / ".system" / "lock").symlink_to("999999999")
    assert machine.run("locate", "x")[0] == 0


def test_a_start_waits_for_another_that_is_setting_up(machine: Machine) -> None:
    lock = machine.home / ".system" / "lock"
    lock.parent.mkdir()
    lock.symlink_to(str(os.getpid()))
    with machine.start("locate", "x") as process:
        assert process.stderr is not None
        assert "waiting" in process.stderr.readline()
        assert machine.calls("pip") == []
        lock.unlink()
        process.communicate()
    assert process.returncode == 0


def test_two_starts_at_once_set_up_once(machine: Machine) -> None:
    with machine.start("locate", "1") as first, machine.start("locate", "2") as second:
        assert [first.communicate()[0][-4:], second.communicate()[0][-4:]] == ["<1>\n", "<2>\n"]
    assert len(machine.calls("pip install")) == 3


FIVE_PASSED = {"PYTEST_REPORT": '<testsuite name="pytest" errors="0" failures="0" skipped="0" tests="5" time="1">'}


@pytest.mark.parametrize(
    ("words", "last_line", "exit_code"),
    [
        ({}, "15 passed, 0 failed", 0),
        ({"MYPY_FAILS": "1"}, "14 passed, 1 failed", 1),
        (
            {"PYTEST_REPORT": '<testsuite errors="1" failures="1" skipped="0" tests="5">', "PYTEST_FAILS": "1"},
            "11 passed, 4 failed",
            1,
        ),
        ({"PYTEST_FAILS": "4"}, "15 passed, 2 failed", 1),
    ],
)
def test_the_tests_end_with_one_plain_line(
    machine: Machine, words: dict[str, str], last_line: str, exit_code: int
) -> None:
    machine.words |= FIVE_PASSED | words
    code, out, _ = machine.run("test")
    assert (code, out.splitlines()[-1]) == (exit_code, last_line)
    assert len(machine.calls("requirements-dev.txt")) == 1


def test_without_chromium_the_browser_tests_are_left_out_and_it_says_so(machine: Machine) -> None:
    machine.remove_tool("chromium")
    machine.words |= {"APT_FAILS": "100", "USER_NUMBER": "1000"}
    _, _, err = machine.run("test")
    assert "There is no Chromium" in err
    assert ["-m not browser" in call for call in machine.calls("-m pytest")] == [True]


def test_the_tests_install_a_postgresql_that_they_may_kill_and_other_commands_do_not(machine: Machine) -> None:
    machine.remove_tool("postgres")
    machine.words["LUBDUB_POSTGRES_DIR"] = "/no/such/place"
    machine.run("locate")
    assert machine.calls("postgresql") == []
    machine.run("test")
    assert "install -y --no-install-recommends postgresql" in machine.calls("postgresql")[0]


def test_a_user_without_rights_gets_postgresql_unpacked_here(machine: Machine) -> None:
    machine.remove_tool("postgres")
    machine.words |= {"LUBDUB_POSTGRES_DIR": "/no/such/place", "USER_NUMBER": "1000"} | FIVE_PASSED
    machine.add_tool(
        "apt-get",
        'for last in "$@"; do :; done\n'
        'case "$*" in *" -s "*) echo "Inst $last (1)" ;; *download*) : >"$last.deb" ;; esac',
    )
    machine.add_tool(
        "dpkg-deb",
        'case "$2" in *postgresql*) bin="$3/usr/lib/postgresql/15/bin"; mkdir -p "$bin"; : >"$bin/postgres" ;; esac',
    )
    _, _, err = machine.run("test")
    assert "unpacking the system packages into .system instead: postgresql" in err
    assert "There is no PostgreSQL" not in err
    _, _, err = machine.run("test")
    assert "postgresql" not in err


def test_the_tests_unpack_a_proxy_and_install_none_that_would_start_by_itself(machine: Machine) -> None:
    machine.remove_tool("caddy")
    machine.words |= FIVE_PASSED
    machine.add_tool(
        "apt-get",
        'echo "apt-get $*" >>"$CALLS"; case "$*" in *download*) : >caddy_2_amd64.deb ;; esac',
    )
    machine.add_tool("dpkg-deb", 'mkdir -p "$3/usr/bin"; : >"$3/usr/bin/caddy"')
    _, _, err = machine.run("test")
    assert "There is no Caddy" not in err
    assert [call for call in machine.calls("caddy") if "install" in call] == []
    _, _, err = machine.run("test")
    assert "proxy" not in err


def test_without_a_proxy_its_tests_are_left_out_and_it_says_so(machine: Machine) -> None:
    machine.remove_tool("caddy")
    machine.words |= {"APT_FAILS": "100", "USER_NUMBER": "1000"}
    _, _, err = machine.run("test")
    assert "There is no Caddy" in err


def test_without_postgresql_its_tests_are_left_out_and_it_says_so(machine: Machine) -> None:
    machine.remove_tool("postgres")
    machine.words |= {"LUBDUB_POSTGRES_DIR": "/no/such/place", "APT_FAILS": "100", "USER_NUMBER": "1000"}
    _, _, err = machine.run("test")
    assert "There is no PostgreSQL" in err
    assert machine.calls("-m pytest") != []


def test_tests_share_the_machine_and_those_with_a_browser_come_after_the_others(machine: Machine) -> None:
    machine.words |= FIVE_PASSED
    machine.run("test")
    others, browsers = machine.calls("-m pytest")
    assert "-n 3" in others
    assert others.endswith("-m not browser")
    assert "-n 2" in browsers
    assert browsers.endswith("-m browser")
