"""One loopback server for each open case."""

from __future__ import annotations

import asyncio
import time

import pytest
import viser

from lubdub.views.servers import ViewRegistry, ViewsFull, start_server


def nothing(server: viser.ViserServer) -> str:
    return "nothing"


def test_a_server_listens_on_loopback_only_and_cannot_be_shared() -> None:
    server = start_server()
    try:
        assert server.get_host() == "127.0.0.1"
        assert server.request_share_url() is None
    finally:
        server.stop()


def test_the_same_case_gets_the_same_view_and_others_their_own() -> None:
    views = ViewRegistry[str]()
    try:
        first, again, other = views.open("a", nothing), views.open("a", nothing), views.open("b", nothing)
        assert first is again
        assert first.port != other.port
    finally:
        views.close_all()
    assert views.get("a") is None


def test_there_is_an_upper_limit_of_open_views() -> None:
    views = ViewRegistry[str](most_open=1)
    try:
        views.open("a", nothing)
        with pytest.raises(ViewsFull):
            views.open("b", nothing)
    finally:
        views.close_all()


def test_a_view_nobody_watches_is_stopped_and_a_watched_one_is_kept() -> None:
    now = [0.0]
    views = ViewRegistry[str](idle_s=600.0, clock=lambda: now[0])
    try:
        views.open("watched", nothing)
        views.open("left", nothing)
        views.watched("watched", +1)
        views.watched("left", +1)
        views.watched("left", -1)
        now[0] = 601.0
        assert views.reap() == ["left"]
        assert views.get("watched") is not None
    finally:
        views.close_all()


def test_each_window_of_a_browser_is_known_by_its_word_until_its_last_connection_goes() -> None:
    views = ViewRegistry[str]()
    try:
        views.open("a", nothing)
        views.watched("a", +1, "left")
        views.watched("a", +1, "left")
        views.watched("a", +1, "right")
        assert views.watched("a", -1, "right") == 2
        assert (views.is_watched("a", "left"), views.is_watched("a", "right"), views.is_watched("a")) == (
            True,
            False,
            True,
        )
        views.close("a")
        assert not views.is_watched("a", "left")
        views.open("a", nothing)
        assert views.watched("a", -1, "left") == 0, "what is left of the view before"
        assert views.watched("a", +1, "left") == 1
    finally:
        views.close_all()


def test_a_view_that_cannot_be_built_leaves_nothing_behind() -> None:
    def broken(server: viser.ViserServer) -> str:
        raise ValueError("no body")

    views = ViewRegistry[str]()
    with pytest.raises(ValueError, match="no body"):
        views.open("a", broken)
    assert views.get("a") is None


async def _longest_pause_while(views: ViewRegistry[str]) -> float:
    longest, last = 0.0, time.monotonic()

    async def tick() -> None:
        nonlocal longest, last
        while True:
            await asyncio.sleep(0.005)
            longest, last = max(longest, time.monotonic() - last), time.monotonic()

    ticking = asyncio.create_task(tick())
    await views.close_soon("a")
    ticking.cancel()
    return longest


def test_stopping_leaves_the_event_loop_free() -> None:
    views = ViewRegistry[str]()
    views.open("a", nothing)
    assert asyncio.run(_longest_pause_while(views)) < 1.0
    assert views.get("a") is None
