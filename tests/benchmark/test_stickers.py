"""The stickers' report counts what it says it counts."""

from __future__ import annotations

from typing import Any

from tests.benchmark.stickers import numbers, report


def row(**facts: Any) -> dict[str, Any]:
    usual = {"group": "men", "number": 0, "pixel_mm": 1.0, "wears": "stickers", "side": "as scanned", "refused": ""}
    return {**usual, "found": 0, **facts}


ROWS = [
    row(
        found=2,
        suprasternal_notch_mm=1.0,
        suprasternal_notch_along_mm=0.5,
        xiphisternum_mm=4.0,
        xiphisternum_along_mm=2.0,
        scale=0.97,
    ),
    row(found=0),
    row(refused="mirrored_by_stickers"),
    row(side="mirrored", refused="mirrored_by_stickers"),
    row(side="mirrored", found=1),
    row(wears="nothing"),
    row(wears="nothing", found=1),
    row(wears="nothing", side="mirrored", refused="mirrored_by_stickers"),
    row(wears="nothing", refused="no_body_found"),
]


def test_every_claim_is_counted_from_its_own_rows() -> None:
    counted = numbers(ROWS)
    assert (counted["scans"], counted["mirrored_scans"], counted["bare_scans"]) == (3, 2, 4)
    assert counted["found_share"] == 2 / 6
    assert counted["some_found_share"] == 1 / 3
    assert (counted["max_mm"], counted["within_3_mm_share"]) == (4.0, 0.5)
    assert counted["mirrored_caught_share"] == 0.5
    assert counted["mirrored_believed"] == 1
    assert counted["called_mirrored_wrongly"] == 1
    assert counted["imagined_on_bare_skin"] == 2
    assert abs(float(counted["largest_scale_error"]) - 0.03) < 1e-9


def test_the_table_has_a_line_for_each_texture_that_was_tried_and_one_for_all() -> None:
    (table,) = report(ROWS).tables
    assert [line[0] for line in table.rows] == ["1 mm a pixel", "all"]
    assert all(len(line) == len(table.columns) for line in table.rows)
