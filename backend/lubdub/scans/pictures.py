"""The pictures that carry a scan's colours. One that is broken or too large costs the colour, never the scan."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Hashable

import numpy as np
from PIL import Image

from lubdub.scans.limits import LIMITS

_DAMAGE = (
    OSError,
    ValueError,
    SyntaxError,
    TypeError,
    KeyError,
    IndexError,
    EOFError,
    OverflowError,
    struct.error,
    zlib.error,
    Image.DecompressionBombError,
)
"""What Pillow raises for pictures that are not what they say."""


class Album:
    """The pictures of one file, each opened once, so many and no more."""

    def __init__(self) -> None:
        """Empty."""
        self.pictures: list[np.ndarray] = []
        self._numbers: dict[Hashable, int | None] = {}

    def number(self, name: Hashable, load: Callable[[], bytes | None]) -> int | None:
        """Which of `pictures` it is, opened if need be; None when it cannot be used. load: gives its file."""
        if name not in self._numbers:
            self._numbers[name] = self._opened(load)
        return self._numbers[name]

    def _opened(self, load: Callable[[], bytes | None]) -> int | None:
        if len(self._numbers) >= LIMITS.pictures or sum(one.nbytes for one in self.pictures) > LIMITS.pictures_open:
            return None
        data = load()
        picture = None if data is None or len(data) > LIMITS.picture_bytes else opened(data)
        if picture is None:
            return None
        self.pictures.append(picture)
        return len(self.pictures) - 1


def opened(data: bytes) -> np.ndarray | None:
    """(h, w, 3) uint8 of a JPEG or PNG, made smaller when it is very large; None when it cannot be used.

    The size stated in the picture's head is checked before a single pixel is unpacked.
    """
    try:
        with Image.open(io.BytesIO(data), formats=("JPEG", "PNG")) as picture:
            if not 0 < picture.width * picture.height <= LIMITS.picture_pixels:
                return None
            most = LIMITS.picture_side
            picture.draft("RGB", (most, most))  # a large JPEG is unpacked at half or a quarter of its size
            shrink = -(-max(picture.size) // most)
            coloured = picture.convert("RGB")
            return np.asarray(coloured.reduce(shrink) if shrink > 1 else coloured)
    except _DAMAGE:
        return None
