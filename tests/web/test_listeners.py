"""Many listeners, one look."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from lubdub.cases.tidings import Standing
from lubdub.web.listeners import Listeners


class Told:
    """Stands for the database: what it says, and what it was asked."""

    def __init__(self) -> None:
        self.says: dict[str, Standing] = {}
        self.asked: list[set[str]] = []

    def look(self, case_ids: Collection[str]) -> Mapping[str, Standing]:
        self.asked.append(set(case_ids))
        return {case_id: self.says[case_id] for case_id in case_ids if case_id in self.says}


def test_however_many_listen_one_look_serves_them() -> None:
    told = Told()
    told.says = {"a": Standing(None, 3), "b": Standing(None, 1)}
    listeners = Listeners(told.look)
    with (
        listeners.listening("a", None) as one,
        listeners.listening("a", None) as other,
        listeners.listening("b", None) as third,
    ):
        listeners.look_again()
        assert told.asked == [{"a", "b"}]
        assert (one(2), other(3), third(1)) == (True, False, False)


def test_before_the_first_look_there_is_no_news() -> None:
    with Listeners(Told().look).listening("a", None) as has_news:
        assert not has_news(0)


def test_a_deleted_case_is_news_and_so_is_one_that_became_somebody_elses() -> None:
    told = Told()
    told.says = {"a": Standing("me", 3), "b": Standing("me", 3)}
    listeners = Listeners(told.look)
    with listeners.listening("a", "me") as of_a, listeners.listening("b", "me") as of_b:
        listeners.look_again()
        assert not of_a(3)
        assert not of_b(3)
        told.says = {"b": Standing("you", 3)}
        listeners.look_again()
        assert of_a(3)
        assert of_b(3)


def test_that_a_case_became_somebody_elses_is_news_once_for_whoever_may_still_listen() -> None:
    told = Told()
    told.says = {"a": Standing("me", 3)}
    listeners = Listeners(told.look)
    with listeners.listening("a", "me") as has_news:
        listeners.look_again()
        assert not has_news(3)
        told.says = {"a": Standing("you", 3)}
        listeners.look_again()
        assert has_news(3)
        assert not has_news(3)


def test_who_has_left_is_looked_for_no_more() -> None:
    told = Told()
    listeners = Listeners(told.look)
    with listeners.listening("a", None), listeners.listening("a", None):
        pass
    listeners.look_again()
    assert told.asked == [set()]
