"""What a browser may say to a live view. Everything else is dropped before viser sees it.

viser trusts its clients: any message class may be sent, one of them opens a public tunnel to the case.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import msgspec

ViewerRole = Literal["placing", "moving", "watching"]

LOOKING = frozenset({"ViewerCameraMessage"})
PLACING = LOOKING | frozenset({"SceneNodeClickMessage", "SceneNodeDragMessage"})
MOVING = LOOKING | frozenset({"SceneNodeDragMessage"})
ALLOWED: dict[ViewerRole, frozenset[str]] = {"watching": LOOKING, "moving": MOVING, "placing": PLACING}


@dataclass(frozen=True)
class Limits:
    """Camera, click and drag messages are some hundred bytes and come at most about 60 times a second."""

    frame_bytes: int = 64 * 1024
    per_second: float = 120.0
    burst: float = 240.0


class FrameTooLarge(Exception):
    """The browser sent more than any honest message needs; the connection ends."""


class Gate:
    """Decides frame by frame for one connection."""

    def __init__(
        self, role: ViewerRole, limits: Limits | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._allowed = ALLOWED[role]
        self._limits = limits or Limits()
        self._clock = clock
        self._tokens = self._limits.burst
        self._last = clock()

    def passes(self, frame: bytes) -> bool:
        """Whether this frame goes on to viser. Raises FrameTooLarge."""
        if len(frame) > self._limits.frame_bytes:
            raise FrameTooLarge
        return self._within_rate() and message_type(frame) in self._allowed and has_finite_numbers(frame)

    def _within_rate(self) -> bool:
        now = self._clock()
        self._tokens = min(self._limits.burst, self._tokens + (now - self._last) * self._limits.per_second)
        self._last = now
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True


def message_type(frame: bytes) -> str | None:
    """The message's own name for itself, None when it has none that can be read."""
    decoded = _decoded(frame)
    kind = decoded.get("type") if isinstance(decoded, dict) else None
    return kind if isinstance(kind, str) else None


def has_finite_numbers(frame: bytes) -> bool:
    """False when any number, at any depth, is infinite or not a number."""
    waiting = [_decoded(frame)]
    while waiting:
        value = waiting.pop()
        if isinstance(value, float) and not math.isfinite(value):
            return False
        if isinstance(value, dict):
            waiting.extend(value.values())
        elif isinstance(value, list):
            waiting.extend(value)
    return True


def _decoded(frame: bytes) -> Any:
    try:
        return msgspec.msgpack.decode(frame)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
