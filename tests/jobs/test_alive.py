"""The health check of a worker's container."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lubdub.jobs.alive import SEEN_S, show_alive, why_not
from lubdub.settings import Settings


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_dir=tmp_path / "data", worker_pulse=tmp_path / "pulse")


def test_before_the_first_round_it_says_so(settings: Settings) -> None:
    assert why_not(settings) == "The worker has not done a round yet."


def test_a_worker_that_just_did_a_round_is_well_and_one_that_hangs_is_not(settings: Settings) -> None:
    show_alive(settings.worker_pulse)
    assert why_not(settings) is None
    assert settings.worker_pulse is not None
    long_ago = time.time() - SEEN_S - 5
    os.utime(settings.worker_pulse, (long_ago, long_ago))
    assert why_not(settings) == f"The worker has done nothing for {SEEN_S + 5:.0f} seconds."


def test_a_pulse_that_cannot_be_renewed_is_said_and_keeps_nobody_from_work(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    show_alive(tmp_path / "no such folder" / "pulse")
    assert "pulse cannot be renewed: FileNotFoundError" in caplog.text


def test_the_check_ends_badly_when_nobody_said_where_to_look(tmp_path: Path) -> None:
    environment = os.environ | Settings(data_dir=tmp_path).to_environment()
    done = subprocess.run(
        [sys.executable, "-m", "lubdub.jobs.alive"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "LUBDUB_WORKER_PULSE names no file" in done.stderr
