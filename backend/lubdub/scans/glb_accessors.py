"""Arrays out of a GLB's binary chunk, each checked against the chunk's length before it is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lubdub.scans.limits import LIMITS, check_counts
from lubdub.scans.reasons import unreadable

_INDEX_KINDS = {5121: "<u1", 5123: "<u2", 5125: "<u4"}
_POSITION_KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}
_SHARE_KINDS = {5121: "<u1", 5123: "<u2", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Accessors:
    """The accessors of one document. document: the parsed JSON; body: the binary chunk."""

    def __init__(self, document: Mapping[str, Any], body: bytes) -> None:
        self._document = document
        self._body = body
        if any("uri" in buffer for buffer in document.get("buffers", [])):
            raise unreadable("other_files")

    def positions(self, number: int) -> np.ndarray:
        """(n, 3) float64 vertex positions in the mesh's own frame."""
        accessor = self._accessor(number)
        if accessor["type"] != "VEC3":
            raise unreadable("bad_header")
        check_counts(accessor["count"])
        kind = np.dtype(_POSITION_KINDS[accessor["componentType"]])
        values = self._read(accessor, kind).astype(np.float64)
        if accessor.get("normalized") and kind.kind in "iu":
            values = np.maximum(values / np.iinfo(kind).max, -1.0)  # glTF 2.0, section 3.11
        return values

    def indices(self, number: int) -> np.ndarray:
        """(n,) int64 vertex numbers."""
        accessor = self._accessor(number)
        if accessor["type"] != "SCALAR" or not 0 <= accessor["count"] <= 3 * LIMITS.faces:
            raise unreadable("bad_header")
        kind = np.dtype(_INDEX_KINDS[accessor["componentType"]])
        return self._read(accessor, kind).astype(np.int64).ravel()

    def shares(self, number: int, kinds: tuple[str, ...]) -> np.ndarray:
        """(n, width) float32 colours or places in a picture; whole numbers stand for shares of their greatest."""
        accessor = self._accessor(number)
        if accessor["type"] not in kinds:
            raise unreadable("bad_header")
        check_counts(accessor["count"])
        kind = np.dtype(_SHARE_KINDS[accessor["componentType"]])
        values = self._read(accessor, kind).astype(np.float32)
        return values if kind.kind == "f" else values / np.float32(np.iinfo(kind).max)

    def view(self, number: int) -> bytes:
        """The bytes of a buffer view."""
        view = _at(self._document["bufferViews"], number)
        start, length = _whole(view.get("byteOffset", 0)), _whole(view["byteLength"])
        if view.get("buffer", 0) != 0 or start + length > len(self._body):
            raise unreadable("cut_short")
        return self._body[start : start + length]

    def _accessor(self, number: int) -> Mapping[str, Any]:
        accessor = _at(self._document["accessors"], number)
        if "sparse" in accessor or "bufferView" not in accessor or not isinstance(accessor["count"], int):
            raise unreadable("bad_header")
        return accessor

    def _read(self, accessor: Mapping[str, Any], kind: np.dtype) -> np.ndarray:
        view = _at(self._document["bufferViews"], accessor["bufferView"])
        width, count = _WIDTHS[accessor["type"]], accessor["count"]
        view_start, view_length = _whole(view.get("byteOffset", 0)), _whole(view["byteLength"])
        offset = _whole(accessor.get("byteOffset", 0))
        stride = _whole(view.get("byteStride", 0)) or width * kind.itemsize
        if view.get("buffer", 0) != 0 or stride > 252:
            raise unreadable("bad_header")
        needed = offset + stride * (count - 1) + width * kind.itemsize if count else 0
        if needed > view_length or view_start + view_length > len(self._body):
            raise unreadable("cut_short")
        return np.ndarray((count, width), kind, self._body, view_start + offset, (stride, kind.itemsize))


def _at(table: Any, number: Any) -> Mapping[str, Any]:
    entry = table[_whole(number)]
    if not isinstance(entry, dict):
        raise unreadable("bad_header")
    return entry


def _whole(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise unreadable("bad_header")
    return value
