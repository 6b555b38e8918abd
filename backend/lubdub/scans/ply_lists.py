"""The face table of a binary PLY, whose rows may differ in length."""

from __future__ import annotations

import struct

import numpy as np

from lubdub.scans.limits import LIMITS
from lubdub.scans.ply_header import Element
from lubdub.scans.reasons import unreadable


def polygons_in_bytes(
    data: bytes, start: int, face: Element, list_place: int, byte_order: str
) -> tuple[list[np.ndarray], int]:
    """The corners of every face, gathered by their number, and where the table ends.

    list_place: which property of face holds the corners. Returns [(k, n) int64, ...], one array for each n.
    Raises ScanUnreadable on lists that are too short, too long, or run over the file's end.
    """
    quick = _all_alike(data, start, face, list_place, byte_order)
    if quick is not None:
        return quick
    before = sum(np.dtype(one.kind).itemsize for one in face.properties[:list_place])
    corner = np.dtype(byte_order + face.properties[list_place].kind)
    counts, starts, end = _walk(data, start, face, list_place, byte_order)
    head = before + np.dtype(face.properties[list_place].count_kind).itemsize
    raw = np.frombuffer(data, np.uint8)
    out = []
    for count in np.unique(counts):
        rows = starts[counts == count] + head
        places = rows[:, None] + np.arange(count * corner.itemsize)
        out.append(np.ascontiguousarray(raw[places]).view(corner).astype(np.int64))
    return out, end


def _all_alike(
    data: bytes, start: int, face: Element, list_place: int, byte_order: str
) -> tuple[list[np.ndarray], int] | None:
    """The usual case in one step: a single list that is as long in every row as in the first."""
    if sum(one.count_kind is not None for one in face.properties) > 1:
        return None
    before = sum(np.dtype(one.kind).itemsize for one in face.properties[:list_place])
    count_type = np.dtype(byte_order + str(face.properties[list_place].count_kind))
    if start + before + count_type.itemsize > len(data):
        raise unreadable("cut_short")
    corners = int(np.frombuffer(data, count_type, 1, start + before)[0])
    if not 3 <= corners <= LIMITS.corners:
        raise unreadable("bad_face")
    columns: list[tuple[str, str] | tuple[str, str, int]] = []
    for place, one in enumerate(face.properties):
        if place == list_place:
            columns += [("count", count_type.str), ("corners", byte_order + one.kind, corners)]
        else:
            columns.append((f"p{place}", byte_order + one.kind))
    row = np.dtype(columns)
    end = start + row.itemsize * face.count
    if end > len(data):
        return None
    rows = np.frombuffer(data, row, face.count, start)
    if not (rows["count"] == corners).all():
        return None
    return [rows["corners"].astype(np.int64)], end


def _walk(
    data: bytes, start: int, face: Element, list_place: int, byte_order: str
) -> tuple[np.ndarray, np.ndarray, int]:
    """Step from row to row. Returns (m,) corner counts, (m,) byte offsets of the rows, and the table's end."""
    steps = [
        (struct.Struct((byte_order or "<") + _code(one.count_kind)) if one.count_kind else None, _size(one.kind))
        for one in face.properties
    ]
    counts, starts, at = [], [], start
    for _ in range(face.count):
        starts.append(at)
        for place, (counter, size) in enumerate(steps):
            if counter is None:
                at += size
                continue
            if at + counter.size > len(data):
                raise unreadable("cut_short")
            (length,) = counter.unpack_from(data, at)
            if place == list_place:
                counts.append(length)
                if not 3 <= length <= LIMITS.corners:
                    raise unreadable("bad_face")
            if length < 0:
                raise unreadable("bad_face")
            at += counter.size + length * size
        if at > len(data):
            raise unreadable("cut_short")
    return np.array(counts), np.array(starts), at


def _size(kind: str) -> int:
    return np.dtype(kind).itemsize


def _code(kind: str) -> str:
    return np.dtype(kind).char
