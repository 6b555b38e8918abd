"""Turning a scan that nobody knows how to lay."""

from __future__ import annotations

import numpy as np
import pytest

from lubdub.views.turning import QUARTERS, TURNS, turned
from tests.views import sample

SCAN = sample.clean_scan()


@pytest.mark.parametrize("way", TURNS)
def test_a_quarter_turns_and_never_mirrors(way: str) -> None:
    assert np.linalg.det(QUARTERS[way]) == pytest.approx(1.0)
    np.testing.assert_allclose(np.linalg.matrix_power(QUARTERS[way], 4), np.eye(3), atol=1e-12)


@pytest.mark.parametrize("turns", [("roll",), ("spin", "tip"), ("tip", "roll", "roll")])
def test_the_files_own_coordinates_stay_what_they_were(turns: tuple[str, ...]) -> None:
    shown = turned(SCAN, turns)
    np.testing.assert_allclose(
        shown.body_from_file.inverse().apply(shown.points), SCAN.body_from_file.inverse().apply(SCAN.points), atol=1e-9
    )


def test_a_roll_turns_the_top_to_the_right_of_the_screen() -> None:
    np.testing.assert_allclose(QUARTERS["roll"] @ [0, 1, 0], [1, 0, 0])


def test_a_spin_brings_the_screens_right_side_to_the_front_and_a_tip_the_top() -> None:
    np.testing.assert_allclose(QUARTERS["spin"] @ [1, 0, 0], [0, 0, 1])
    np.testing.assert_allclose(QUARTERS["tip"] @ [0, 1, 0], [0, 0, 1])
