"""One timed run in a process of its own: `python -m tests.benchmark.stopwatch SCAN WORDS METHOD` prints JSON."""

from __future__ import annotations

import json
import resource
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from lubdub import methods, pipeline
from lubdub.fitting.paper import fit_paper
from lubdub.fitting.schedule import FAITHFUL
from lubdub.library.load import load_library
from lubdub.results import Patient

FAITHFUL_NAME = "paper, 25,000 vertices"


def run(scan: Path, words: Path, method: str) -> dict[str, Any]:
    """Seconds of the first and the second run, the second one's stages and work, and the most memory ever held.

    cpu_s adds up what all cores worked, and does not count waiting for a busy machine.
    """
    said = json.loads(words.read_text())
    clicks = {name: np.array(place) for name, place in said["clicks"].items()}
    known: Any = method.split(",")[0]
    request = pipeline.Request(Patient(said["age"], said["sex"]), clicks, method=known)
    library = load_library()
    seconds, worked = [], 0.0
    for _ in range(2):
        begun, worked_before = time.perf_counter(), time.process_time()
        outcome = pipeline.locate(scan.read_bytes(), request, library)
        seconds.append(round(time.perf_counter() - begun, 4))
        worked = round(time.process_time() - worked_before, 4)
    stages = {stage: round(value, 4) for stage, value in outcome.timings_s.items() if stage != "total"}
    peak_mb = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)
    first, second = seconds
    found = {"seconds": second, "first_s": first, "cpu_s": worked, "peak_mb": peak_mb}
    return {**found, "verdict": outcome.verdict, "stages": stages}


def main(scan: str, words: str, method: str) -> None:
    """Print what was measured."""
    source = partial(fit_paper, settings=FAITHFUL) if method == FAITHFUL_NAME else fit_paper
    with mock.patch.object(methods, "fit_paper", source):
        found = run(Path(scan), Path(words), method)
    sys.stdout.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
