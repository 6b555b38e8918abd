"""What an experiment is: units of work that each leave rows, and a report that adds the rows up."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = dict[str, Any]
"""One measurement as it is written: plain words and numbers only."""

Cell = str | float | int | None


@dataclass(frozen=True)
class Unit:
    """A piece of work of a few seconds or minutes. Its rows are kept as soon as it ends, under `key`."""

    key: str
    work: Callable[[], list[Row]]


@dataclass(frozen=True)
class Table:
    """A table of the report. rows: the first cell of each says what it is."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[Sequence[Cell]]

    def markdown(self) -> str:
        """As it is printed and quoted."""
        lines = [f"### {self.title}", "", f"| {' | '.join(self.columns)} |", "|---" * len(self.columns) + "|"]
        lines += [f"| {' | '.join(map(_shown, row))} |" for row in self.rows]
        return "\n".join(lines)


@dataclass(frozen=True)
class Report:
    """numbers: what NAME.json holds beside the tables. plots: file stem -> draws into an empty figure.

    words: what stands before the tables in NAME.md.
    """

    tables: tuple[Table, ...]
    numbers: Mapping[str, Any] = field(default_factory=dict)
    plots: Mapping[str, Callable[[Figure], None]] = field(default_factory=dict)
    words: str = ""


@dataclass(frozen=True)
class Experiment:
    """One NAME of `./lubdub benchmark`. units(size, seed) must be cheap to list: the work is in the units."""

    name: str
    help: str
    size: int
    size_means: str
    units: Callable[[int, int], Iterable[Unit]]
    report: Callable[[list[Row]], Report]


def _shown(cell: Cell) -> str:
    if cell is None:
        return "-"
    return f"{cell:.2f}" if isinstance(cell, float) else str(cell)
