"""The same scan gives the same bytes, and the demo scans what they gave before."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.golden import GOLDEN, METHODS, kept_of

PROJECT = Path(__file__).parents[1]
TOLERANCE_MM = 2.0
"""Another processor, solver or library rounds otherwise, which moves a place by far less; 2 mm would matter."""
DEMOS = ("overhead-bed", "phone-child", "scanner-woman")
TWICE = DEMOS[1:]


def started(threads: int, *names: str) -> subprocess.Popen[str]:
    """`tests.golden` in a process of its own, allowed so many threads."""
    paths = os.pathsep.join([str(PROJECT / "backend"), str(PROJECT)])
    count = str(threads)
    environment = os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": count, "OPENBLAS_NUM_THREADS": count}
    command = [sys.executable, "-m", "tests.golden", *names]
    return subprocess.Popen(command, cwd=PROJECT, env=environment, stdout=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def found() -> Mapping[int, dict[str, Any]]:
    """Number of threads -> demo scan -> method -> result."""
    running = {1: started(1, *DEMOS), 2: started(2, *TWICE)}
    return {threads: json.loads(process.communicate()[0]) for threads, process in running.items()}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", TWICE)
def test_two_processes_with_one_and_two_threads_give_the_same_bytes(
    name: str, method: str, found: Mapping[int, dict[str, Any]]
) -> None:
    one, two = (json.dumps(found[threads][name][method]) for threads in (1, 2))
    assert one == two


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", DEMOS)
def test_the_demo_scans_give_what_they_gave_before(name: str, method: str, found: Mapping[int, dict[str, Any]]) -> None:
    golden = json.loads(GOLDEN.read_text())[name]
    now, before = kept_of(found[1][name])[method], golden[method]
    again = "if this was meant: PYTHONPATH=backend:. .venv/bin/python -m tests.golden"
    assert now["verdict"] == before["verdict"], again
    assert now["areas"].keys() == before["areas"].keys(), again
    for area, place in before["areas"].items():
        moved = np.linalg.norm(np.array(now["areas"][area]) - place) * golden["mm_per_unit"]
        assert moved < TOLERANCE_MM, f"{area} moved by {moved:.1f} mm; {again}"
