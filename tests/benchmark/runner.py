"""Runs an experiment so that an interruption loses one unit at most, and writes what came out."""

from __future__ import annotations

import csv
import hashlib
import json
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from tests.benchmark.experiment import Experiment, Report, Row, Unit

PROJECT = Path(__file__).parents[2]
CODE = ("backend/lubdub", "references", "tests/benchmark")


def run_experiment(experiment: Experiment, size: int, seed: int, out: Path) -> Report:
    """Run what no earlier, interrupted run has left, then write NAME.json, NAME.csv, NAME.md and plots to `out`."""
    out.mkdir(parents=True, exist_ok=True)
    journal = Journal(out / f"{experiment.name}.partial.jsonl", {"seed": seed, "code": code_hash()})
    units = list(experiment.units(size, seed))
    rows = [row for unit in _with_bar(units, experiment.name) for row in journal.rows_of(unit)]
    report = experiment.report(rows)
    _write(report, rows, out / experiment.name, {"seed": seed, "size": size, **_circumstances()})
    journal.forget()
    return report


class Journal:
    """Rows of finished units, a line each. One written by other code or another seed is not believed."""

    def __init__(self, path: Path, header: Row) -> None:
        self._path = path
        self._done: dict[str, list[Row]] = {}
        lines = [_parsed(line) for line in path.read_text().splitlines()] if path.exists() else []
        if lines and lines[0] == header:
            self._done = {line["key"]: line["rows"] for line in lines[1:] if line}
        else:
            path.write_text(json.dumps(header) + "\n")

    def rows_of(self, unit: Unit) -> list[Row]:
        """The unit's rows: remembered, or worked out and remembered."""
        if unit.key not in self._done:
            rows = unit.work()
            with self._path.open("a") as file:
                file.write(json.dumps({"key": unit.key, "rows": rows}) + "\n")
            self._done[unit.key] = rows
        return self._done[unit.key]

    def forget(self) -> None:
        """The run is complete."""
        self._path.unlink()


def _parsed(line: str) -> Row:
    """A line of the journal; the last one of a killed run may be torn."""
    try:
        return dict(json.loads(line))
    except ValueError:
        return {}


def code_hash() -> str:
    """Changes with every line of code or body that a result depends on."""
    digest = hashlib.sha256()
    for folder in CODE:
        for path in sorted((PROJECT / folder).rglob("*")):
            if path.is_file() and path.suffix in {".py", ".npz", ".json"}:
                digest.update(path.read_bytes())
    return digest.hexdigest()


def _with_bar(units: Sequence[Unit], name: str) -> Any:
    from tqdm import tqdm

    return tqdm(units, desc=name, unit="unit", file=sys.stderr, disable=None)


def _circumstances() -> Row:
    import os

    cores = len(os.sched_getaffinity(0))
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": f"{platform.machine()}, {cores} cores, Python {platform.python_version()}",
    }


def _write(report: Report, rows: list[Row], stem: Path, facts: Row) -> None:
    tables = {table.title: {"columns": table.columns, "rows": table.rows} for table in report.tables}
    document = {**facts, **report.numbers, "tables": tables}
    stem.with_suffix(".json").write_text(json.dumps(document, indent=1) + "\n")
    stem.with_suffix(".md").write_text(_page(report, stem.name, facts))
    with stem.with_suffix(".csv").open("w", newline="") as file:
        names = list(dict.fromkeys(name for row in rows for name in row))
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
    for name, draw in report.plots.items():
        _draw(draw, stem.parent / f"{stem.name}-{name}.png")


def _page(report: Report, name: str, facts: Row) -> str:
    command = f"`./lubdub benchmark {name} --seed {facts['seed']} --size {facts['size']}`"
    parts = [report.words.strip(), f"{command}, {facts['date']}, {facts['machine']}."]
    parts += [f"![{plot}]({name}-{plot}.png)" for plot in report.plots]
    return "\n\n".join(part for part in (*parts, *(table.markdown() for table in report.tables)) if part) + "\n"


def _draw(draw: Any, path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), dpi=120, layout="constrained")
    draw(figure)
    figure.savefig(path)
