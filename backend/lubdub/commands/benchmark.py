"""`lubdub benchmark`: runs one of the experiments in `tests/benchmark/` again and keeps its numbers.

An experiment is a module there with `run(seed: int, size: int | None, out: Path)`. What it returns is written to
`OUT/NAME.json`; tables and plots it writes to OUT itself.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.locate import write_whole

PROJECT = Path(__file__).resolve().parents[3]

Experiment = Callable[[int, int | None, Path], Mapping[str, Any]]


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("benchmark", help="run an experiment again and write its numbers")
    parser.add_argument("name", help=f"one of: {', '.join(experiments())}")
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same numbers")
    parser.add_argument("--size", type=int, metavar="N", help="how many bodies (default: the experiment's own number)")
    parser.add_argument("--out", type=Path, default=Path("out"), metavar="DIR", help="folder for the results")
    parser.set_defaults(run=_run)


def experiments() -> list[str]:
    """The names of all experiments, by their files."""
    files = sorted((PROJECT / "tests" / "benchmark").glob("[a-z]*.py"))
    return [file.stem for file in files if "\ndef run(" in file.read_text()]


def _run(typed: argparse.Namespace) -> int:
    if typed.name not in experiments():
        raise CommandFault(f"There is no experiment {typed.name!r}; there are {', '.join(experiments())}.")
    if typed.size is not None and typed.size < 1:
        raise CommandFault("The size is the number of bodies: 1 or more.")
    try:
        typed.out.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise CommandFault(f"The folder {typed.out} cannot be made: {fault.strerror}.") from fault
    sys.path.insert(0, str(PROJECT))
    run: Experiment = importlib.import_module(f"tests.benchmark.{typed.name}").run
    numbers = run(typed.seed, typed.size, typed.out)
    path = typed.out / f"{typed.name}.json"
    write_whole(path, (json.dumps(numbers, indent=2, allow_nan=False) + "\n").encode())
    sys.stdout.write(f"{path}\n")
    return 0
