"""`./lubdub benchmark NAME`: measures, prints tables, writes NAME.json, NAME.csv, NAME.md and plots.

A run that was interrupted goes on where it stopped when it is started again with the same words.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from lubdub.library.load import LibraryDamaged
from lubdub.settings import Settings
from tests.benchmark import accuracy, damaged, paper_tables, references, repeat, stickers
from tests.benchmark.calibration import CALIBRATION
from tests.benchmark.colour import COLOUR_EXPERIMENT
from tests.benchmark.experiment import Experiment
from tests.benchmark.hostile import HOSTILE
from tests.benchmark.journey import JOURNEY
from tests.benchmark.load import LOAD
from tests.benchmark.peers import PEERS_EXPERIMENT
from tests.benchmark.review import REVIEW
from tests.benchmark.runner import run_experiment
from tests.benchmark.selection import SELECTION
from tests.benchmark.speed import SPEED

EXPERIMENTS: tuple[Experiment, ...] = (
    accuracy.DEMO,
    accuracy.COHORT,
    CALIBRATION,
    COLOUR_EXPERIMENT,
    damaged.DAMAGED,
    HOSTILE,
    JOURNEY,
    LOAD,
    paper_tables.PAPER,
    repeat.REPEAT,
    SELECTION,
    PEERS_EXPERIMENT,
    references.experiment(None),
    REVIEW,
    SPEED,
    stickers.STICKERS_EXPERIMENT,
)


def main(arguments: Sequence[str]) -> int:
    """Run one experiment; returns the exit code."""
    by_name = {experiment.name: experiment for experiment in EXPERIMENTS}
    parser = _parser()
    typed = parser.parse_args(arguments)
    experiment = by_name[typed.name]
    if typed.name == "references":
        try:
            experiment = references.experiment(_own_folder(parser, typed.references))
        except LibraryDamaged as fault:
            parser.error(str(fault))
    report = run_experiment(experiment, typed.size or experiment.size, typed.seed, typed.out)
    for table in report.tables:
        sys.stdout.write(f"{table.markdown()}\n\n")
    sys.stdout.write(f"Written to {typed.out / typed.name}.json, .csv and .md\n")
    return 0


def _parser() -> argparse.ArgumentParser:
    lines = [f"  {one.name:12} {one.help} (size: {one.size_means}, usually {one.size})" for one in EXPERIMENTS]
    parser = argparse.ArgumentParser(
        prog="lubdub benchmark",
        description=__doc__,
        epilog="experiments:\n" + "\n".join(lines),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", metavar="NAME", choices=[one.name for one in EXPERIMENTS], help="which, see below")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other people and other noise")
    parser.add_argument("--size", "--files", type=_count, help="how much of it; see below")
    parser.add_argument("--minutes", type=_count, dest="size", help="the same, for what is measured in minutes")
    parser.add_argument(
        "--references", type=Path, metavar="DIR", help="for `references`: the folder of one's own bodies and marks"
    )
    parser.add_argument("--out", type=Path, default=Path("out/benchmark"), metavar="DIR")
    return parser


def _own_folder(parser: argparse.ArgumentParser, named: Path | None) -> Path:
    """The folder that was named, or the service's own."""
    folder = named or Settings().references
    if folder is None:
        parser.error(
            "there are no reference bodies or marks of your own yet: add some, or name a folder (--references)"
        )
    return folder


def _count(word: str) -> int:
    if not word.isdecimal() or int(word) < 1:
        raise argparse.ArgumentTypeError("must be a whole number of at least 1")
    return int(word)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
