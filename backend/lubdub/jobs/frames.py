"""The small language a sandboxed child speaks on its pipe: one byte of kind, eight of length, then the body.

The reading side trusts nothing: every length is capped before a byte of the body is kept.
"""

from __future__ import annotations

import json
import math
import os
import struct
from collections.abc import Iterator
from enum import IntEnum

HEADER = struct.Struct("<BQ")
BLOCK_BYTES = 2**18
MAX_ANSWER_BYTES = 256 * 2**20
MAX_WORDS_BYTES = 2**16
MAX_STAGE_CHARACTERS = 64


class Kind(IntEnum):
    """What a frame says. All but PROGRESS are final: the child ends after one."""

    PROGRESS = 1
    RESULT = 2
    UNREADABLE = 3
    REFUSED = 4
    MEMORY = 5
    ERROR = 6


class BadFrame(Exception):
    """The other side does not speak this language."""


def send(output: int, kind: Kind, body: bytes) -> None:
    """Write one frame to a file descriptor, whole. Raises ValueError when the body is over its cap."""
    if len(body) > _cap(kind):
        raise ValueError(f"an answer of {len(body)} bytes is over the cap of {_cap(kind)}")
    rest = memoryview(HEADER.pack(kind, len(body)) + body)
    while rest:
        rest = rest[os.write(output, rest) :]


def progress_body(stage: str, fraction: float) -> bytes:
    """The body of a PROGRESS frame."""
    return json.dumps([stage, float(fraction)]).encode()


def reason_texts(body: bytes) -> tuple[str, str]:
    """Message and advice inside the body of a REFUSED or UNREADABLE frame; empty when it holds none."""
    try:
        reason = json.loads(body)
    except ValueError:
        reason = None
    if not isinstance(reason, dict):
        return "", ""
    return str(reason.get("message", "")), str(reason.get("advice", ""))


class Reader:
    """Puts frames together from whatever pieces arrive. `final` holds the last frame once it is complete."""

    def __init__(self) -> None:
        self.final: tuple[Kind, bytes] | None = None
        self._waiting = bytearray()

    def feed(self, block: bytes) -> Iterator[tuple[str, float]]:
        """Take in a block and yield the progress reports it completes. Raises BadFrame."""
        self._waiting += block
        while len(self._waiting) >= HEADER.size:
            number, length = HEADER.unpack_from(self._waiting)
            kind = _kind(number)
            if self.final is not None or length > _cap(kind):
                raise BadFrame(f"{kind.name} of {length} bytes")
            if len(self._waiting) < HEADER.size + length:
                return
            body = bytes(memoryview(self._waiting)[HEADER.size : HEADER.size + length])
            del self._waiting[: HEADER.size + length]
            if kind is Kind.PROGRESS:
                yield _progress(body)
            else:
                self.final = (kind, body)


def _kind(number: int) -> Kind:
    try:
        return Kind(number)
    except ValueError as fault:
        raise BadFrame(f"kind {number}") from fault


def _cap(kind: Kind) -> int:
    return MAX_ANSWER_BYTES if kind is Kind.RESULT else MAX_WORDS_BYTES


def _progress(body: bytes) -> tuple[str, float]:
    try:
        stage, fraction = json.loads(body)
    except (ValueError, TypeError) as fault:
        raise BadFrame("progress that is no pair") from fault
    if not isinstance(stage, str) or not isinstance(fraction, int | float) or not math.isfinite(fraction):
        raise BadFrame("progress of the wrong kind")
    return stage[:MAX_STAGE_CHARACTERS], min(max(float(fraction), 0.0), 1.0)
