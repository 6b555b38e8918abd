"""`lubdub benchmark`: hands over to the experiments, which live with the tests."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).resolve().parents[3]


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Name the command in the help of all commands; `run` reads what follows it."""
    commands.add_parser("benchmark", help="run an experiment again: errors in mm, written as JSON and CSV")


def run(arguments: Sequence[str]) -> int:
    """Run `tests/benchmark` with these words and return its exit code."""
    sys.path.insert(0, str(PROJECT))
    code: int = importlib.import_module("tests.benchmark.__main__").main(arguments)
    return code
