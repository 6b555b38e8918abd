"""What every method finds on the demo scans, kept in golden.json so that a change of the numbers is seen.

After a change that is meant to move them, write the file anew and look at the difference:

    PYTHONPATH=backend:. .venv/bin/python -m tests.golden

With names of demo scans behind it, the command prints what it finds and writes nothing.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from lubdub.library.load import load_library
from lubdub.pipeline import Request, locate
from lubdub.report.result_json import result_json
from lubdub.results import AREA_NAMES
from tests.benchmark.demo import demo_cases
from tests.benchmark.measure import Case

GOLDEN = Path(__file__).with_name("golden.json")
METHODS = ("lubdub", "paper", "rule")


def found_on(case: Case) -> dict[str, Any]:
    """Method -> the whole result of a demo scan, but for how long it took."""
    results = {}
    for method in METHODS:
        outcome = locate(case.data, Request(case.patient, case.clicks, method=method), load_library())
        results[method] = {name: value for name, value in result_json(outcome).items() if name != "timings_s"}
    return results


def kept_of(results: dict[str, Any]) -> dict[str, Any]:
    """What is compared with later runs and other machines: verdict, and places in the file's coordinates."""
    kept = {}
    for method, result in results.items():
        areas = {name: result["areas"][name]["position"] for name in AREA_NAMES if name in result.get("areas", {})}
        kept[method] = {"verdict": result["verdict"], "areas": areas}
    return kept


def main(names: list[str]) -> None:
    """Print the results of the named demo scans, or keep those of all."""
    if names:
        json.dump({case.name: found_on(case) for case in demo_cases() if case.name in names}, sys.stdout)
        return
    kept = {case.name: {"mm_per_unit": case.mm_per_unit, **kept_of(found_on(case))} for case in demo_cases()}
    GOLDEN.write_text(json.dumps(kept, indent=1) + "\n")
    sys.stdout.write(f"Written to {GOLDEN}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
