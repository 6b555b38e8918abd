"""The master key by command: shown, rotated and retired, with clear words."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tests.test_cli import Run, is_one_line, run

__all__ = ["run"]


@pytest.fixture(autouse=True)
def data_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LUBDUB_DATA_DIR", str(tmp_path / "data"))
    return tmp_path / "data"


def test_a_rotation_by_command_says_what_was_done_and_what_comes_next(run: Run, data_dir: Path) -> None:
    _, shown, _ = run("admin", "master-key", "show")
    code, out, err = run("admin", "master-key", "rotate")
    assert code == 0
    assert "1 key sealed anew" in out
    assert "./lubdub admin master-key retire" in out
    assert "A new master key is in use" in err
    first = shown.split()[3]
    assert f"Older master key:   {first}" in run("admin", "master-key", "show")[1]
    code, _, err = run("admin", "master-key", "retire")
    assert (code, is_one_line(err)) == (2, True)
    old = time.time() - 100
    os.utime(data_dir / "master.key", (old, old))
    assert run("admin", "master-key", "retire")[:2] == (
        0,
        "1 old master key dropped. Destroy its copies, too.\n",
    )
    assert first not in run("admin", "master-key", "show")[1]


def test_a_master_key_that_does_not_fit_is_one_sentence(run: Run, data_dir: Path) -> None:
    run("admin", "master-key", "show")
    (data_dir / "master.key").write_text(f"plain {run('admin', 'master-key', 'new')[1]}")
    code, out, err = run("admin", "master-key", "rotate")
    assert (code, out, is_one_line(err)) == (2, "", True)
    assert "is not the one that sealed what is stored here" in err
