"""Waiting: what is being done, how long it takes, who is first; and stopping."""

from __future__ import annotations

from datetime import timedelta
from types import SimpleNamespace
from typing import Any

import pytest

from lubdub.cases.clock import now
from lubdub.cases.store import Standing
from lubdub.web.pages.waiting import time_words
from tests.web.family import Family
from tests.web.service import Service, eventually

REQUEST: Any = SimpleNamespace(cookies={}, headers={}, state=SimpleNamespace(), query_params={})


def said(fraction: float, seconds: float, ahead: int = 0, status: str = "running") -> str:
    case: Any = SimpleNamespace(status=status, fraction=fraction)
    return time_words(REQUEST, case, Standing(now() - timedelta(seconds=seconds), ahead))


@pytest.mark.parametrize(
    ("fraction", "seconds", "words"),
    [
        (0.0, 2.0, ""),
        (0.5, 4.0, "Only a few seconds to go."),
        (0.25, 10.0, "About 40 seconds to go."),
        (0.9, 90.0, "This takes longer than usual."),
    ],
)
def test_the_time_left_follows_from_the_work_done(fraction: float, seconds: float, words: str) -> None:
    assert said(fraction, seconds).startswith(words)
    assert bool(said(fraction, seconds)) == bool(words)


def test_others_before_us_are_said_calmly() -> None:
    assert said(0.0, 5.0, ahead=1, status="queued") == "One other scan is before yours."
    assert said(0.0, 5.0, ahead=3, status="queued") == "3 other scans are before yours."


def test_nothing_is_said_when_the_work_has_ended() -> None:
    assert said(1.0, 5.0, status="done") == ""


def test_one_may_leave_come_back_and_stop(service: Service) -> None:
    family = Family(service)
    case = family.opened()
    family.send(case, b"slow 30")
    page = family.get(f"/cases/{case}")
    assert "Looking at the scan" in page
    assert "You can leave this page and come back." in page
    told = family.http.get(f"/cases/{case}/state").json()
    assert set(told) == {"stage", "left", "fraction", "next"}
    family.post(f"/cases/{case}/cancel")
    assert family.where(case) == "scan"


def test_a_second_scan_waits_behind_the_first(service: Service) -> None:
    first, second = Family(service), Family(service)
    one, two = first.opened(), second.opened()
    first.send(one, b"slow 30")
    eventually(lambda: first.http.get(f"/cases/{one}/state").json()["fraction"] > 0)
    second.send(two, b"slow 30")
    assert second.http.get(f"/cases/{two}/state").json()["left"].endswith("before yours.")
    second.post(f"/cases/{two}/cancel")
    first.post(f"/cases/{one}/cancel")
