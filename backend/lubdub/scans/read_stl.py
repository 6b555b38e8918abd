"""STL, binary and text. Its triangles share no corners, so equal corners are joined again."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

from lubdub.results import RawScan
from lubdub.scans.limits import check_counts, check_rest, checked_surface
from lubdub.scans.reasons import unreadable
from lubdub.scans.tables import check_columns, number_table

_HEAD_BYTES = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FIRST_WORD = re.compile(rb"^[ \t]*(\S+)", re.MULTILINE)
_WORDS = {b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid"}
_VERTEX_LINE = re.compile(rb"^[ \t]*vertex[ \t]+([^\r\n]*)", re.MULTILINE | re.IGNORECASE)


def binary_facet_count(data: bytes) -> int:
    """How many triangles a binary STL says it has."""
    return int.from_bytes(data[80:_HEAD_BYTES], "little")


def looks_binary(data: bytes) -> bool:
    """True when the stated count explains the file's length, give or take a trailing note."""
    needed = _HEAD_BYTES + _FACET.itemsize * binary_facet_count(data)
    return len(data) > _HEAD_BYTES and needed <= len(data) <= needed + 1024


def read_stl(data: bytes) -> RawScan:
    """Read an STL. Raises ScanUnreadable when it is damaged."""
    corners = _binary_corners(data) if looks_binary(data) else _text_corners(data)
    check_counts(len(corners), len(corners) // 3)
    vertices, index = join_equal(corners)
    return RawScan(checked_surface(vertices, index.reshape(-1, 3)), "stl")


def _binary_corners(data: bytes) -> np.ndarray:
    count = binary_facet_count(data)
    check_counts(max(count // 3, 1), count)
    check_rest(data, _HEAD_BYTES + _FACET.itemsize * count)
    facets = np.frombuffer(data, _FACET, count, _HEAD_BYTES)
    return np.ascontiguousarray(facets["corners"]).reshape(-1, 3)


def _text_corners(data: bytes) -> np.ndarray:
    lines = _VERTEX_LINE.findall(data)
    if not lines or len(lines) % 3 or b"endsolid" not in data[-4096:].lower():
        raise unreadable("cut_short")
    words = Counter(word.lower() for word in _FIRST_WORD.findall(data))
    if not words.keys() <= _WORDS:
        raise unreadable("bad_line")
    if not 3 * words[b"facet"] == len(lines) == 3 * words[b"endfacet"]:
        raise unreadable("bad_face")
    check_columns(lines, 3)
    return number_table(lines, (0, 1, 2)).astype(np.float32)


def join_equal(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give bit-equal points one index. corners: (n, 3) float32. Returns (v, 3) points and (n,) their index.

    Sorting one word of hash and position is many times faster than sorting rows; points that only share a
    hash are told apart afterwards, so the joining is exact.
    """
    bits = np.ascontiguousarray(corners + np.float32(0), np.float32).view(np.uint32)  # + 0 makes -0 equal 0
    place_bits = np.uint64(max(len(bits).bit_length(), 1))
    words = np.sort((_hashed(bits) >> place_bits << place_bits) | np.arange(len(bits), dtype=np.uint64))
    order = (words & ((np.uint64(1) << place_bits) - np.uint64(1))).astype(np.int64)
    keys = words >> place_bits
    is_first = np.concatenate([[True], keys[1:] != keys[:-1]])
    index = np.empty(len(bits), np.int64)
    index[order] = np.cumsum(is_first) - 1
    points = bits[order[is_first]]
    strangers = (np.take(points, index, axis=0) != bits).any(axis=1)
    if strangers.any():
        more, their_index = np.unique(bits[strangers], axis=0, return_inverse=True)
        index[strangers] = len(points) + their_index.ravel()
        points = np.concatenate([points, more])
    return points.view(np.float32).astype(np.float64), index


def _hashed(bits: np.ndarray) -> np.ndarray:
    mixed = np.zeros(len(bits), np.uint64)
    for axis, factor in enumerate((0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)):
        mixed = (mixed ^ bits[:, axis]) * np.uint64(factor)
        mixed ^= mixed >> np.uint64(29)
    return mixed
