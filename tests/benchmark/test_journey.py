"""The report of the journey's benchmark: what was measured stands beside what is promised."""

from __future__ import annotations

from typing import Any

from tests.benchmark.journey import report


def rows(usable_s: float, taps: int) -> list[dict[str, Any]]:
    first = {"what": "first visit", "kB": 32.0, "shown_s": 1.0}
    return [
        first | {"page": "/", "usable_s": 1.1},
        first | {"page": "/ask/who", "usable_s": usable_s},
        {"what": "on the way", "page": "/", "kB": 32.0},
        {"what": "on the way", "page": "result", "kB": 20.0},
        {"what": "sample", "taps": taps, "visible_s": 3.0, "drawn_s": 4.0, "load": 1.0},
    ]


def kept(usable_s: float, taps: int) -> dict[str, str]:
    promised = report(rows(usable_s, taps)).tables[0]
    return {str(row[0]): str(row[3]) for row in promised.rows}


def test_the_slowest_page_and_the_most_taps_decide_what_is_kept() -> None:
    assert set(kept(1.9, 12).values()) == {"yes"}
    assert kept(2.1, 12)["usable, s"] == "no"
    assert kept(1.9, 13)["taps with the sample"] == "no"


def test_pages_are_listed_in_the_order_of_the_way() -> None:
    way = report(rows(1.9, 5)).tables[2]
    assert [row[0] for row in way.rows] == ["/", "result"]
