"""`./lubdub benchmark NAME`: measures, prints a table, writes NAME.json and NAME.csv."""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lubdub.library.load import load_library
from lubdub.results import MethodName
from tests.benchmark.measure import Row, run_all, summary

RUNS: dict[str, tuple[tuple[MethodName, str], ...]] = {
    "demo": (
        ("lubdub", "five"),
        ("rule", "five"),
        ("paper", "five"),
        ("lubdub", "paper's three"),
        ("rule", "paper's three"),
        ("paper", "paper's three"),
        ("lubdub", "none"),
    ),
    "cohort": (
        ("lubdub", "five"),
        ("rule", "five"),
        ("lubdub", "paper's three"),
        ("rule", "paper's three"),
        ("paper", "paper's three"),
    ),
}


def main(arguments: Sequence[str]) -> int:
    """Run one benchmark; returns the exit code."""
    parser = argparse.ArgumentParser(prog="lubdub benchmark", description=__doc__)
    parser.add_argument("name", choices=sorted(RUNS), help="demo: the three demo scans; cohort: unseen people")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other people (cohort)")
    parser.add_argument("--size", type=int, default=20, help="how many people (cohort)")
    parser.add_argument("--out", type=Path, default=Path("out/benchmark"), metavar="DIR")
    typed = parser.parse_args(arguments)
    if typed.size < 1:
        parser.error("--size must be at least 1")
    rows = run_all(_cases(typed), RUNS[typed.name], load_library())
    document = report(rows)
    document["seed"], document["size"] = typed.seed, len({row.case for row in rows})
    typed.out.mkdir(parents=True, exist_ok=True)
    (typed.out / f"{typed.name}.json").write_text(json.dumps(document, indent=1) + "\n")
    _write_csv(typed.out / f"{typed.name}.csv", rows)
    sys.stdout.write(table(document) + f"\nWritten to {typed.out / typed.name}.json and .csv\n")
    return 0


def _cases(typed: argparse.Namespace) -> Any:
    if typed.name == "demo":
        from tests.benchmark.demo import demo_cases

        return demo_cases()
    from tests.benchmark.cohort import cohort_cases

    return cohort_cases(typed.size, typed.seed)


def report(rows: Sequence[Row]) -> dict[str, Any]:
    """`overall` is the default method with five landmarks; then every method, and its groups."""
    runs: dict[str, Any] = {}
    for method, landmarks in dict.fromkeys((row.method, row.landmarks) for row in rows):
        of_run = [row for row in rows if (row.method, row.landmarks) == (method, landmarks)]
        groups = {
            group: summary([row for row in of_run if row.group == group])
            for group in dict.fromkeys(row.group for row in of_run)
        }
        runs[f"{method}, {landmarks}"] = {**summary(of_run), "groups": groups}
    return {
        "overall": summary([row for row in rows if (row.method, row.landmarks) == ("lubdub", "five")]),
        "runs": runs,
    }


def table(document: dict[str, Any]) -> str:
    """The runs as a Markdown table."""
    columns = ("mean_mm", "median_mm", "p95_mm", "max_mm", "mitral_mm", "held_share", "shown_share", "median_s")
    lines = [f"| method, landmarks | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for name, numbers in document["runs"].items():
        cells = ["-" if numbers[column] is None else f"{numbers[column]:.2f}" for column in columns]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _write_csv(path: Path, rows: Sequence[Row]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in dataclasses.fields(Row)])
        for row in rows:
            values = dataclasses.astuple(row)
            writer.writerow([json.dumps(value) if isinstance(value, (dict, tuple)) else value for value in values])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
