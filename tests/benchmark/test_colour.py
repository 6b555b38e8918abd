"""The report on suggestions by colour counts what it says it counts, and people are painted as it says."""

from __future__ import annotations

from typing import Any

import numpy as np

from lubdub.results import LANDMARK_NAMES
from references.make.areolas import coloured, with_plaster
from references.make.paint import draw_complexion
from references.make.phenotype import draw_phenotype
from tests.benchmark.colour import COLOUR, COLUMNS, GREY, SHAPE, grey_moves, report, summary
from tests.bodies import torso_scan


def row(number: int, look: str, off: float, **facts: Any) -> dict[str, Any]:
    marks = {f"{name}_mm": off for name in LANDMARK_NAMES} | {f"{name}_doubt_mm": 5.0 for name in LANDMARK_NAMES}
    who = {"group": "men", "number": number, "scanner": "phone LiDAR mesh", "darker": 0.4, "refused": ""}
    return {**who, "look": look, **marks, **facts}


ROWS = [
    row(0, SHAPE, 8.0),
    row(0, COLOUR, 2.0),
    row(0, "mole", 12.0),
    row(0, GREY, 8.0),
    row(1, SHAPE, 4.0, nipple_left_mm=6.0),
    row(1, COLOUR, 4.0),
    row(1, "shadow", 4.0),
    row(1, GREY, 4.0, nipple_left_mm=6.5),
    {**row(2, SHAPE, 0.0), "refused": "orientation_unknown"},
]


def test_errors_are_counted_by_landmark_and_look() -> None:
    seen = [one for one in ROWS if not one["refused"]]
    by_shape, by_colour = summary(seen, SHAPE, "nipples"), summary(seen, COLOUR, "nipples")
    assert (by_shape["marks"], by_shape["median"], by_shape["max"], by_shape["within"]) == (4, 7.0, 8.0, 0.25)
    assert (by_colour["marks"], by_colour["median"], by_colour["within"]) == (4, 3.0, 1.0)
    assert grey_moves(seen) == 0.5
    assert dict.fromkeys(COLUMNS) == summary([], SHAPE, "navel")


def test_each_deceiver_is_held_against_shape_alone_on_the_same_people() -> None:
    deceived = next(table for table in report(ROWS).tables if table.title == "What deceives")
    lines = {tuple(line[:3]): line[3:] for line in deceived.rows}
    assert lines["mole", "nipples", SHAPE][:2] == (2, 8.0)
    assert lines["mole", "nipples", COLOUR][:2] == (2, 12.0)
    assert lines["mole", "nipples", COLOUR][-1] == 2
    assert lines["shadow", "navel", COLOUR][-1] == 0
    assert lines["plaster", "navel", SHAPE][0] is None
    assert "2 people; 1 more were refused" in report(ROWS).words
    assert "0 of the 2 were laid wrongly" in report(ROWS).words


def test_painted_areolas_are_darker_and_no_less_red_than_the_skin_and_a_plaster_covers_one() -> None:
    torso = torso_scan(columns=60, rows=60)
    marks = np.array([torso.landmarks[name] for name in LANDMARK_NAMES[2:]])
    for seed in range(20):
        random = np.random.default_rng(seed)
        person = draw_phenotype(random, 30.0, "female")
        skin = coloured(random, draw_complexion(random, torso.surface, np.zeros((0, 3)), 1.0), marks, person, 150.0)
        for patch in skin.patches[1:]:
            assert 10.0 <= patch.radius <= 25.0
            assert (patch.tone < skin.tone).all()
            assert patch.tone[0] / patch.tone[1] > skin.tone[0] / skin.tone[1]
        assert sorted(with_plaster(random, skin).patches[-1].over(marks[1:])) == [0.0, 1.0]
