"""The arithmetic of the review's benchmark: the model's seconds, the waits, and what is promised."""

from __future__ import annotations

from typing import Any

import pytest

from lubdub.results import AREA_NAMES
from tests.benchmark.review import REVIEW, interaction_s, report


def rows(case: str, waited_s: float = 1.0, by: str = "click", more: int = 0) -> list[dict[str, Any]]:
    actions = ["open", *AREA_NAMES, *["undo"] * more, "sign"]
    return [{"case": case, "action": action, "by": by, "waited_s": waited_s, "load": 2.0} for action in actions]


def table(title: str, rows: list[dict[str, Any]]) -> dict[str, list[Any]]:
    (found,) = (one for one in report(rows).tables if one.title.startswith(title))
    return {str(name): list(cells) for name, *cells in found.rows}


def test_a_case_by_mouse_is_one_hand_six_decisions_pointings_and_clicks_and_four_looks() -> None:
    assert interaction_s(rows("a")) == pytest.approx(0.4 + 6 * (1.35 + 1.1 + 0.2) + 4 * 3.0)


def test_keys_need_neither_pointing_nor_a_hand_on_the_mouse() -> None:
    assert interaction_s(rows("a", by="key")) == pytest.approx(6 * (1.35 + 0.28) + 4 * 3.0)


def test_waiting_is_added_up_apart_from_the_interaction_which_it_does_not_change() -> None:
    quick, slow = (table("Case by case", rows("a", waited))["a"] for waited in (0.5, 2.0))
    assert quick[1] == slow[1]
    assert (quick[2], slow[2]) == pytest.approx((3.0, 12.0))
    assert slow[3] == pytest.approx(slow[1] + slow[2])


def test_the_looking_time_that_is_left_fills_the_minute() -> None:
    actions, interaction, waited, _both, look_for, _load = table("Case by case", rows("a"))["a"]
    assert actions == 6
    assert interaction + waited + 4 * (look_for - 3.0) == pytest.approx(60.0)


def test_the_median_case_decides_on_seconds_and_the_longest_on_actions() -> None:
    cases = [*rows("a", 0.5), *rows("b", 100.0), *rows("c", 1.0, more=1)]
    promised = table("What is promised", cases)
    assert promised["actions"] == [7.0, 6.0, "no"]
    assert promised["interaction, s"][2] == "yes"
    assert promised["interaction and waiting, s"][2] == "yes"
    assert table("What is promised", rows("b", 100.0))["interaction and waiting, s"][2] == "no"


def test_the_operators_of_the_table_add_up_to_the_interaction() -> None:
    together = [cells[2] for cells in table("Interaction", rows("a")).values()]
    assert sum(together) == pytest.approx(interaction_s(rows("a")))


def test_waits_are_told_for_each_action_in_the_order_of_the_review() -> None:
    waits = table("Measured wait", [*rows("a", 1.0), *rows("b", 3.0)])
    assert list(waits) == ["open", *AREA_NAMES, "sign"]
    assert waits["sign"] == [2.0, 3.0]


def test_a_seed_draws_the_order_of_the_bodies_and_every_case_has_its_own_name() -> None:
    orders = {tuple(unit.key for unit in REVIEW.units(3, seed)) for seed in range(1, 9)}
    assert len(orders) > 1
    keys = [unit.key for unit in REVIEW.units(7, 1)]
    assert len(set(keys)) == 7
