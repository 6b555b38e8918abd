import numpy as np
import pytest

from lubdub.library.load import load_library
from tests.benchmark.selection import SELECTION, drawn_references, looked_up, report


def row(references: int, seconds: float, rank: int = 1, excess: float = 0.0) -> dict:
    times = {"seconds": seconds, "exhaustive_s": 10 * seconds, "index_s": 0.1}
    return {"way": "rank_by_shape", "references": references, "rank": rank, "excess": excess, **times}


def test_the_table_tells_growth_and_the_worst_choice() -> None:
    rows = [row(24, 0.01), row(240, 0.02, rank=3, excess=0.04), row(240, 0.02)]
    rows.append({"way": "choose", "references": 24, "seconds": 5.0})
    small, large = report(rows).tables[0].rows
    assert small == (24, 0.01, None, 0.1, 0.1, 1.0, 1, 0.0, 5.0)
    assert large == (240, 0.02, pytest.approx(2.0), 0.2, 0.1, 0.5, 3, 0.04, None)
    assert report(rows).numbers["slowest_median_s"] == 0.02


def test_drawn_libraries_hold_small_and_large_bodies_and_are_always_the_same() -> None:
    basis = load_library().basis
    first, again = (drawn_references(basis, 30, np.random.default_rng(4)) for _ in range(2))
    assert all(np.array_equal(a.surface.vertices, b.surface.vertices) for a, b in zip(first, again, strict=True))
    lengths = [np.ptp(one.surface.vertices[:, 1]) for one in first]
    assert max(lengths) > 2 * min(lengths)


def test_a_body_is_looked_up_both_ways() -> None:
    (found,) = looked_up(60, 1, 2, 1)
    assert found["rank"] >= 1
    assert 0 <= found["excess"] < 0.2


def test_libraries_of_all_sizes_are_units_and_the_papers_way_has_one_each() -> None:
    keys = [unit.key for unit in SELECTION.units(2, 1)]
    assert keys == [f"{count} {what}" for count in (24, 240, 2400) for what in ("0", "1", "choose")]
