"""The command line: one line for every mistake, the promised exit codes, and never a traceback."""

from __future__ import annotations

import ctypes
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lubdub import cli
from lubdub.commands import landmarks_file, locate
from lubdub.results import AREA_NAMES, LANDMARK_NAMES
from tests import bodies

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def run(*words: object) -> tuple[int, str, str]:
        try:
            code = cli.main([str(word) for word in words])
        except SystemExit as end:  # argparse ends wrong use and --help this way
            code = int(end.code or 0)
        out, err = capfd.readouterr()
        return code, out, err

    return run


def typed(*words: object) -> tuple[int, str, str]:
    """The command in a process of its own, as people type it: whole runs fork, and tests hold threads and locks."""
    end = subprocess.run(
        [sys.executable, "-m", "lubdub", *map(str, words)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    return end.returncode, end.stdout, end.stderr


@pytest.fixture(scope="module")
def child_scan() -> bodies.BodyScan:
    return bodies.rescale(bodies.turn(bodies.hide_side(bodies.torso_scan(size=0.6)), degrees=(5, 20, 0)), "m")


@pytest.fixture
def scan(tmp_path: Path, child_scan: bodies.BodyScan) -> Path:
    path = tmp_path / "child.ply"
    path.write_bytes(bodies.write_ply(child_scan.surface))
    return path


@pytest.fixture
def landmarks(tmp_path: Path, child_scan: bodies.BodyScan) -> Path:
    path = tmp_path / "L.json"
    path.write_text(json.dumps({name: list(position) for name, position in child_scan.landmarks.items()}))
    return path


def is_one_line(text: str) -> bool:
    return text.count("\n") == 1 and text.endswith("\n") and "Traceback" not in text


def test_a_good_scan_gives_the_four_areas_and_exit_code_0(scan: Path, landmarks: Path, tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    code, out, err = typed("locate", scan, "--landmarks", landmarks, "--age", 6, "--picture", picture)
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["verdict"] in {"show", "show_with_care"}
    assert set(result["areas"]) == set(AREA_NAMES)
    assert result["unit"] == {"name": "m", "mm_per_unit": 1000.0, "source": "found"}
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_refused_scan_gives_its_reason_and_exit_code_3(tmp_path: Path) -> None:
    belly = bodies.rescale(bodies.only_belly(bodies.torso_scan()), "mm")
    path = tmp_path / "belly.ply"
    path.write_bytes(bodies.write_ply(belly.surface))
    code, out, err = typed("locate", path, "--age", 30, "--unit", "mm", "--out", tmp_path / "result.json")
    assert (code, out, err) == (3, "", "")
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["verdict"] == "refuse"
    assert result["reasons"]
    assert "areas" not in result


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00" * 1000,
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0\n",
        b"solid x\nfacet normal 0 0 nan\nendsolid x\n",
        b"PK\x03\x04 not really a zip",
    ],
)
def test_a_file_that_is_no_scan_ends_in_one_line_and_exit_code_2(run: Run, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(content)
    out_file = tmp_path / "before.json"
    out_file.write_text("as before")
    code, out, err = run("locate", path, "--out", out_file)
    assert (code, out) == (2, "")
    assert is_one_line(err)
    assert out_file.read_text() == "as before"


@pytest.mark.parametrize(
    "end",
    [
        lambda *_: ctypes.string_at(0),
        lambda *_: os._exit(7),
        lambda *_: bytes(2**42),
        lambda *_: 1 // 0,
    ],
    ids=["segmentation fault", "sudden exit", "all the memory", "our own fault"],
)
def test_even_a_crash_of_the_reader_ends_in_one_line(
    run: Run, scan: Path, monkeypatch: pytest.MonkeyPatch, end: Callable[..., Any]
) -> None:
    monkeypatch.setattr("lubdub.pipeline.locate", end)
    code, out, err = run("locate", scan)
    assert (code, out) == (2, "")
    assert is_one_line(err)


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["dance"],
        ["locate"],
        ["locate", "no-such-file.ply"],
        ["locate", "."],
        ["locate", "SCAN", "--age", "six"],
        ["locate", "SCAN", "--age", "nan"],
        ["locate", "SCAN", "--age", "-1"],
        ["locate", "SCAN", "--age", "1e9"],
        ["locate", "SCAN", "--sex", "yes"],
        ["locate", "SCAN", "--posture", "standing"],
        ["locate", "SCAN", "--unit", "inch"],
        ["locate", "SCAN", "--method", "guess"],
        ["locate", "SCAN", "--references", "no-such-folder"],
        ["locate", "SCAN", "--references", "."],
        ["locate", "SCAN", "--landmarks", "no-such-file.json"],
        ["locate", "SCAN", "--out", "no-such-folder/out.json"],
        ["locate", "SCAN", "--out", "."],
        ["locate", "SCAN", "--picture", "no-such-folder/p.png"],
        ["admin"],
        ["admin", "key", "revoke"],
        ["serve", "--port", "many"],
        ["serve", "--port", "70000"],
        ["serve", "--host", "0.0.0.0"],
    ],
)
def test_wrong_use_ends_in_one_line_and_exit_code_2(
    run: Run, scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*[str(scan) if word == "SCAN" else word for word in words])
    assert (code, out) == (2, "")
    assert is_one_line(err)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("", "not JSON"),
        ("[1, 2", "not JSON"),
        ("[" * 50_000, "not JSON"),
        ("[]", "one JSON object"),
        ('{"nipple": [0, 0, 0]}', "'nipple'"),
        ('{"navel": [0, 0]}', "navel must be three finite numbers"),
        ('{"navel": [0, 0, NaN]}', "navel must be three finite numbers"),
        ('{"navel": [0, 0, 1e999]}', "navel must be three finite numbers"),
        ('{"navel": [0, 0, "0"]}', "navel must be three finite numbers"),
        ('{"navel": [0, 0, true]}', "navel must be three finite numbers"),
        ('{"navel": null}', "navel must be three finite numbers"),
        ('{"navel": [0, 0, 1' + "0" * 4000 + "]}", "navel must be three finite numbers"),
        ('{"navel": [0, 0, 1], "navel": [0, 0, 2]}', "twice"),
        ('{"navel": [0, 0, 1]}' + " " * 200_000, "one JSON object"),
    ],
)
def test_a_landmarks_file_that_is_not_right_is_named_in_one_line(
    run: Run, scan: Path, tmp_path: Path, content: str, complaint: str
) -> None:
    path = tmp_path / "L.json"
    path.write_text(content)
    code, out, err = run("locate", scan, "--landmarks", path)
    assert (code, out) == (2, "")
    assert is_one_line(err)
    assert complaint in err


def test_the_landmark_names_typed_are_those_of_the_pipeline() -> None:
    assert landmarks_file.NAMES == LANDMARK_NAMES


def test_a_written_file_is_whole_and_obeys_the_umask(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    before = os.umask(0o027)
    try:
        locate.write_whole(path, b"new")
    finally:
        os.umask(before)
    assert path.read_bytes() == b"new"
    assert path.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_and_a_pipe_are_written_into_and_not_replaced(tmp_path: Path) -> None:
    real, link, pipe = tmp_path / "real", tmp_path / "link", tmp_path / "pipe"
    real.write_text("old")
    link.symlink_to(real)
    locate.write_whole(link, b"new")
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        locate.write_whole(pipe, b"through")
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_an_interruption_ends_quietly_with_its_own_code(run: Run, scan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(path: Path) -> bytes:
        raise KeyboardInterrupt

    monkeypatch.setattr(locate, "_read_scan", interrupt)
    assert run("locate", scan) == (130, "", "")


def test_a_reader_that_leaves_early_hears_no_complaint(tmp_path: Path) -> None:
    left, right = os.pipe()
    os.close(left)
    with os.fdopen(right, "wb") as deaf:
        end = subprocess.run(
            [sys.executable, "-m", "lubdub", "admin", "settings"],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
            stdout=deaf,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (end.returncode, end.stderr) == (0, "")


def test_help_loads_none_of_the_heavy_libraries() -> None:
    program = (
        f"import sys; sys.path[:] = {sys.path!r}; before = set(sys.modules); from lubdub import cli\n"
        "try: cli.main(['locate', '--help'])\n"
        "finally: print(sorted({name.split('.')[0] for name in set(sys.modules) - before}))"
    )
    end = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "SCAN" in end.stdout
    assert not {"numpy", "scipy", "open3d", "pydantic", "fastapi", "sqlalchemy"} & set(
        json.loads(end.stdout.splitlines()[-1].replace("'", '"'))
    )


def test_the_openapi_document_is_printed(run: Run) -> None:
    code, out, _ = run("openapi")
    assert code == 0
    assert json.loads(out)["openapi"].startswith("3.")


def test_a_portal_key_is_made_listed_and_revoked(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LUBDUB_DATA_DIR", str(tmp_path / "data"))
    code, token, hint = run("admin", "key", "create", "the clinic's portal")
    assert code == 0
    assert len(token.strip()) > 20
    assert "shown this once" in hint
    _, listed, _ = run("admin", "key", "list")
    assert "the clinic's portal" in listed
    assert token.strip() not in listed
    key = listed.split()[0]
    assert run("admin", "key", "revoke", key)[0] == 0
    assert run("admin", "key", "revoke", key)[0] == 2
    assert "revoked" in run("admin", "key", "list")[1]


def test_a_key_with_an_unknown_power_is_not_made(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LUBDUB_DATA_DIR", str(tmp_path / "data"))
    code, _, err = run("admin", "key", "create", "portal", "--scope", "everything")
    assert code == 2
    assert is_one_line(err)
    assert run("admin", "key", "list")[1] == ""


def test_clinicians_are_let_in_listed_and_shut_out(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from lubdub.settings import Settings
    from tests.web.service import Service
    from tests.web.staff import new_account

    monkeypatch.setenv("LUBDUB_DATA_DIR", str(tmp_path / "data"))
    code, link, _ = run("admin", "clinician", "first")
    assert code == 0
    assert re.fullmatch(r"http://localhost:8000/desk/join#[\w-]{43}\n", link)
    email = new_account(Service(Settings()), "administrator").clinician.email
    code, _, err = run("admin", "clinician", "first")
    assert (code, is_one_line(err)) == (2, True)
    assert "/desk/join#" in run("admin", "clinician", "invite", email, "--role", "lead")[1]
    code, _, err = run("admin", "clinician", "disable", email)
    assert (code, is_one_line(err)) == (2, True)
    new_account(Service(Settings()), "administrator")
    assert run("admin", "clinician", "role", email, "lead")[0] == 0
    assert run("admin", "clinician", "disable", email)[0] == 0
    assert f"{email}  disabled  lead" in run("admin", "clinician", "list")[1]
    assert run("admin", "clinician", "enable", email)[0] == 0
    assert run("admin", "clinician", "disable", "nobody@heart.example")[0] == 2


def test_every_setting_is_shown_with_its_meaning(run: Run) -> None:
    from lubdub.settings import Settings

    out = run("admin", "settings")[1]
    for name, field in Settings.model_fields.items():
        assert f"LUBDUB_{name.upper()}=" in out
        assert field.description in out


def test_the_words_of_a_benchmark_go_to_the_experiments(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[str] = []
    experiments = SimpleNamespace(main=lambda words: heard.extend(words) or 7)
    monkeypatch.setattr("importlib.import_module", {"tests.benchmark.__main__": experiments}.__getitem__)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    assert run("benchmark", "cohort", "--seed", 3, "--help")[0] == 7
    assert heard == ["cohort", "--seed", "3", "--help"]


def test_a_database_that_cannot_be_opened_is_one_sentence(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LUBDUB_DATABASE_URL", "postgresql+psycopg://nobody@127.0.0.1:1/none")
    code, said, faults = run("admin", "key", "list")
    assert (code, said) == (2, "")
    assert faults == "lubdub: The database cannot be opened. Is it running, and is LUBDUB_DATABASE_URL right?\n"


@pytest.mark.parametrize("words", [(), ("--paper", "letter", "--size", "small")])
def test_the_sticker_sheet_is_written_to_the_file_named(run: Run, tmp_path: Path, words: tuple[str, ...]) -> None:
    path = tmp_path / "sheet.pdf"
    code, out, err = run("stickers", *words, "--out", path)
    assert (code, err) == (0, "")
    assert str(path) in out
    assert path.read_bytes().startswith(b"%PDF")


def test_a_sticker_sheet_that_cannot_be_written_is_one_line(run: Run, tmp_path: Path) -> None:
    code, out, err = run("stickers", "--out", tmp_path / "nowhere" / "sheet.pdf")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1


def test_a_sticker_sheet_in_a_language_nobody_knows_is_one_line(run: Run, tmp_path: Path) -> None:
    code, out, err = run("stickers", "--language", "xx", "--out", tmp_path / "sheet.pdf")
    assert (code, out) == (2, "")
    assert "no language xx" in err
    assert err.count("\n") == 1
