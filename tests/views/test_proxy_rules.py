"""What a browser may say to a live view."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viser import _messages as messages

from lubdub.views.proxy_rules import PLACING, FrameTooLarge, Gate, Limits, has_finite_numbers, message_type

EVERY_MESSAGE = sorted(kind.__name__ for kind in messages.Message.get_subclasses())


def frame(kind: str, **fields: Any) -> bytes:
    return msgspec.msgpack.encode({"type": kind, **fields})


def test_the_names_we_let_through_are_messages_of_this_viser() -> None:
    assert set(EVERY_MESSAGE) >= PLACING


@pytest.mark.parametrize("kind", EVERY_MESSAGE)
def test_only_looking_clicking_and_dragging_pass(kind: str) -> None:
    assert Gate("placing").passes(frame(kind)) == (kind in PLACING)


@pytest.mark.parametrize("kind", ["ShareUrlRequest", "ShareUrlDisconnect", "RunJavascriptMessage"])
def test_a_request_to_share_or_run_script_is_dropped(kind: str) -> None:
    assert not Gate("placing").passes(frame(kind))


@pytest.mark.parametrize("kind", EVERY_MESSAGE)
def test_somebody_who_only_watches_may_only_move_the_camera(kind: str) -> None:
    assert Gate("watching").passes(frame(kind)) == (kind == "ViewerCameraMessage")


@given(st.binary(max_size=200))
def test_any_bytes_are_judged_without_an_error(data: bytes) -> None:
    kind = message_type(data)
    assert Gate("placing").passes(data) == (kind in PLACING and has_finite_numbers(data))


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), [1.0, [float("-inf")]], {"x": float("nan")}])
def test_numbers_that_are_none_are_dropped(bad: Any) -> None:
    assert not Gate("placing").passes(frame("SceneNodeClickMessage", ray_origin=bad))


def test_a_frame_larger_than_any_honest_one_ends_the_connection() -> None:
    with pytest.raises(FrameTooLarge):
        Gate("placing").passes(frame("ViewerCameraMessage", padding=b"x" * (64 * 1024)))


def test_a_flood_is_thinned_and_the_gate_opens_again() -> None:
    now = [0.0]
    gate = Gate("watching", Limits(per_second=10.0, burst=5.0), clock=lambda: now[0])
    look = frame("ViewerCameraMessage")
    assert [gate.passes(look) for _ in range(8)] == [True] * 5 + [False] * 3
    now[0] = 1.0
    assert gate.passes(look)
