"""`./lubdub benchmark load`: what one machine bears, measured at the real service with real jobs.

A web process and one or two workers over a PostgreSQL of their own (SQLite where there is none), and the clients, all
on the cores of this machine: the clients' work is part of what is measured. A case is a child's scan from a phone, sent
by REST, checked, marked and located; `cores_busy` is all that worked on the machine meanwhile, so two workers can
be no faster than that leaves room for. Waits are counted from the moment a call is due, ten a second, whatever the
earlier ones took. Memory is resident memory, of a process and all its children. `load` is how many processes wanted a
core when a part began: on an idle machine about nothing.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

from tests.benchmark import load_open, load_parts
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.load_watch import growth

LEAST_RATIO, MOST_P99_MS, MOST_GROWTH = 1.8, 100.0, 0.1
ROUNDS = 3
"""One worker and two take turns: a rented machine wanders by a seventh from one quarter of an hour to the next."""
WATCHED = ("memory_mb", "descriptors", "sockets", "threads", "processes")


def _units(size: int, seed: int) -> Iterable[Unit]:
    for number in range(1, ROUNDS + 1):
        for workers in (1, 2):
            work = functools.partial(load_parts.cases_per_minute, workers, number)
            yield Unit(f"cases with {workers}, round {number}", work)
    yield Unit("latency", load_parts.latencies)
    yield Unit("streams", load_open.streams)
    yield Unit("views", load_open.views)
    yield Unit("tenfold", load_parts.tenfold)
    yield Unit(f"soak of {size} minutes", functools.partial(load_open.soak, size))


def report(rows: list[Row]) -> Report:
    """What was measured beside what is promised, and then each part."""
    by_part: dict[str, list[Row]] = {}
    for row in rows:
        by_part.setdefault(row["part"], []).append(row)
    soak = _soak(by_part["soak"])
    found = {
        "two workers over one": _per_minute(by_part["cases"], 2) / _per_minute(by_part["cases"], 1),
        "p99 while jobs run, ms": max(row["p99_ms"] for row in by_part["latency"] if row["workers"] == "busy"),
        "memory's growth in the soak": soak[0][2] / soak[0][1] - 1,
        "accepted and lost at tenfold load": by_part["tenfold"][0]["lost"],
    }
    limits = dict(zip(found, (LEAST_RATIO, MOST_P99_MS, MOST_GROWTH, 0), strict=True))
    kept: list[tuple[Cell, ...]] = []
    for name, value in found.items():
        is_kept = value >= limits[name] if name == "two workers over one" else value <= limits[name]
        kept.append((name, float(value), float(limits[name]), "yes" if is_kept else "no"))
    tables = (
        Table("What is promised", ("what", "measured", "limit", "kept"), kept),
        _table("Cases a minute", by_part["cases"]),
        _table("Waits for pages and calls", by_part["latency"]),
        _table("Event streams open at once", by_part["streams"]),
        _table("3D views open at once", by_part["views"]),
        _table("Ten times as much as the workers can do", by_part["tenfold"]),
        Table(
            f"Soak: {soak_minutes(by_part['soak']):.0f} minutes of whole cases, views and streams, opened and ended",
            ("what", "second quarter", "last quarter", "change"),
            soak,
        ),
    )
    return Report(tables, {"found": found}, words=__doc__.split("\n", 2)[2] if __doc__ else "")


def _per_minute(rows: list[Row], workers: int) -> float:
    """Over all rounds."""
    rounds = [row for row in rows if row["workers"] == workers]
    return 60 * sum(row["cases"] for row in rounds) / sum(row["seconds"] for row in rounds)


def _table(title: str, rows: list[Row]) -> Table:
    columns = tuple(name for name in rows[0] if name != "part")
    return Table(title, columns, [tuple(row[name] for name in columns) for row in rows])


def _soak(rows: list[Row]) -> list[tuple[Any, ...]]:
    lines: list[tuple[Any, ...]] = []
    for name in WATCHED:
        early, late = growth([float(row[name]) for row in rows])
        lines.append((name, early, late, f"{100 * (late / early - 1):+.1f} %"))
    cases = max(row["cases"] for row in rows)
    return [*lines, ("whole cases done", None, float(cases), "-")]


def soak_minutes(rows: list[Row]) -> float:
    """How long it lasted."""
    return float(max(row["second"] for row in rows)) / 60


LOAD = Experiment("load", "what one machine bears, for how long, and what then", 60, "minutes of soak", _units, report)
