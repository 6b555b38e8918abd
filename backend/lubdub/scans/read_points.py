"""Point clouds: PCD (text, binary, compressed) and columns of text (XYZ, PTS, TXT, CSV)."""

from __future__ import annotations

import io
import re
import struct
from dataclasses import dataclass

import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.results import RawScan
from lubdub.scans.limits import LIMITS, check_counts, check_rest, checked_surface
from lubdub.scans.reasons import unreadable
from lubdub.scans.tables import check_columns, number_table

_PCD_HEAD_END = re.compile(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", re.MULTILINE)
_PCD_VERSIONS = (".5", ".6", ".7")
_PCD_ENCODINGS = ("ascii", "binary", "binary_compressed")
_SEPARATORS = (b";", b",", b"\t")
_PCD_WORDS = {"VERSION": 1, "WIDTH": 1, "HEIGHT": 1, "VIEWPOINT": 7, "POINTS": 1, "DATA": 1}
"""Lines of a PCD's head, and how many words follow; of the other four as many as there are fields."""
_MOST_HEADING = 4  # names of columns, a count, and a line to spare
_NO_TRIANGLES = np.zeros((0, 3), np.int64)


@dataclass(frozen=True)
class _PcdHead:
    fields: tuple[str, ...]
    sizes: tuple[int, ...]
    kinds: tuple[str, ...]
    counts: tuple[int, ...]
    points: int
    encoding: str
    body_start: int

    @property
    def row_bytes(self) -> int:
        return sum(size * count for size, count in zip(self.sizes, self.counts, strict=True))

    def canonical(self) -> bytes:
        """The same head, written anew, so that the library never meets the file's own."""
        rows = {
            "VERSION": "0.7",
            "FIELDS": " ".join(self.fields),
            "SIZE": " ".join(map(str, self.sizes)),
            "TYPE": " ".join(self.kinds),
            "COUNT": " ".join(map(str, self.counts)),
            "WIDTH": self.points,
            "HEIGHT": 1,
            "VIEWPOINT": "0 0 0 1 0 0 0",
            "POINTS": self.points,
            "DATA": self.encoding,
        }
        return "".join(f"{key} {value}\n" for key, value in rows.items()).encode()


def read_pcd(data: bytes) -> RawScan:
    """Read a PCD. Points without a measurement (all three nan, as PCD writes them) are left out.

    Raises ScanUnreadable when it is damaged, or promises more than it holds.
    """
    head = _pcd_head(data)
    check_counts(head.points)
    body = data[head.body_start :]
    if head.encoding == "ascii":
        points = _pcd_text(body, head)
    else:
        _check_body(body, head)
        points = _pcd_binary(body, head)
    measured = ~np.isnan(points).all(axis=1)
    return RawScan(_surface(points[measured]), "pcd")


def _surface(points: np.ndarray) -> Surface:
    return checked_surface(points, _NO_TRIANGLES)


def _pcd_head(data: bytes) -> _PcdHead:
    end = _PCD_HEAD_END.search(data, 0, LIMITS.header_bytes)
    if end is None:
        raise unreadable("bad_header")
    said = [line for line in data[: end.end()].splitlines() if not line.lstrip().startswith(b"#")]
    if not b"".join(said).isascii():
        raise unreadable("bad_header")
    words = [line.decode("ascii").split() for line in said]
    rows = {line[0].upper(): tuple(line[1:]) for line in words if line}
    fields_wide = dict.fromkeys(("FIELDS", "SIZE", "TYPE", "COUNT"), len(rows.get("FIELDS", ())))
    if any((_PCD_WORDS | fields_wide).get(word) != len(rest) for word, rest in rows.items()):
        raise unreadable("bad_header")
    if rows.get("VERSION", ("0.7",))[0].lstrip("0") not in _PCD_VERSIONS:
        raise unreadable("bad_header")
    if not all(_is_number(word.encode()) for word in rows.get("VIEWPOINT", ())):
        raise unreadable("bad_header")
    encoding = end.group(1).decode()
    try:
        fields = rows["FIELDS"]
        sizes = tuple(int(word) for word in rows["SIZE"])
        counts = tuple(int(word) for word in rows.get("COUNT", ("1",) * len(fields)))
        area = int(rows["WIDTH"][0]) * int(rows["HEIGHT"][0])
        points = int(rows.get("POINTS", (area,))[0])
        head = _PcdHead(fields, sizes, rows["TYPE"], counts, points, encoding, end.end())
    except (KeyError, IndexError, ValueError) as error:
        raise unreadable("bad_header") from error
    if not _is_sound(head) or points != area:
        raise unreadable("bad_header")
    return head


def _is_sound(head: _PcdHead) -> bool:
    columns = len(head.fields)
    if not (len(head.sizes) == len(head.kinds) == len(head.counts) == columns) or columns > 64:
        return False
    if head.encoding not in _PCD_ENCODINGS or any(not 1 <= count <= 1024 for count in head.counts):
        return False
    places = [head.fields.index(axis) if head.fields.count(axis) == 1 else -1 for axis in "xyz"]
    if -1 in places or any(head.counts[place] != 1 or head.kinds[place] != "F" for place in places):
        return False
    allowed = {"F": (4, 8), "U": (1, 2, 4, 8), "I": (1, 2, 4, 8)}
    return all(size in allowed.get(kind, ()) for size, kind in zip(head.sizes, head.kinds, strict=True))


def _pcd_text(body: bytes, head: _PcdHead) -> np.ndarray:
    lines = [line for line in body.splitlines() if line.strip()]
    if len(lines) != head.points:
        raise unreadable("cut_short" if len(lines) < head.points else "too_long")
    check_columns(lines, sum(head.counts))
    starts = np.cumsum((0, *head.counts))
    return number_table(lines, [int(starts[head.fields.index(axis)]) for axis in "xyz"])


def _check_body(body: bytes, head: _PcdHead) -> None:
    """Raises ScanUnreadable unless the body is as long as the head says, packed or not."""
    whole = head.row_bytes * head.points
    if head.encoding == "binary":
        if len(body) < whole:
            raise unreadable("cut_short")
        check_rest(body, whole)
        return
    if len(body) < 8:
        raise unreadable("cut_short")
    packed, unpacked = struct.unpack_from("<II", body)
    if packed > len(body) - 8 or unpacked != whole or unpacked > LIMITS.file_bytes:
        raise unreadable("cut_short")
    check_rest(body, 8 + packed)


def _pcd_binary(body: bytes, head: _PcdHead) -> np.ndarray:
    from pypcd4.pypcd4 import PointCloud  # its import costs a quarter of a second that other formats need not pay

    named = tuple(name if name in "xyz" else f"other{place}" for place, name in enumerate(head.fields))
    safe = _PcdHead(named, head.sizes, head.kinds, head.counts, head.points, head.encoding, 0)
    try:
        read = PointCloud.from_fileobj(io.BufferedReader(io.BytesIO(safe.canonical() + body)))
    except (ValueError, RuntimeError, MemoryError, TypeError) as error:
        raise unreadable("cut_short") from error
    return np.stack([np.asarray(read.pc_data[axis], np.float64) for axis in "xyz"], axis=1)


def read_xyz(data: bytes) -> RawScan:
    """Read columns x y z [more], with a heading or a count line before them or not.

    Raises ScanUnreadable when a line does not begin with three numbers, or when the count says there are more.
    """
    lines = [line for line in data.splitlines() if line.strip() and not line.lstrip().startswith((b"#", b"//"))]
    separator = next((mark for mark in _SEPARATORS if lines and mark in lines[-1]), None)
    heading = next((place for place, line in enumerate(lines[:_MOST_HEADING]) if _is_row(line, separator)), 0)
    promised = lines[heading - 1].strip() if heading else b""
    lines = lines[heading:]
    check_counts(len(lines))
    if promised.isdigit() and int(promised[:20]) > len(lines):
        raise unreadable("cut_short")
    check_columns(lines, len(lines[0].split(separator)), separator)
    points = number_table(lines, (0, 1, 2), separator=separator.decode() if separator else None)
    return RawScan(_surface(points), "xyz")


def _is_row(line: bytes, separator: bytes | None) -> bool:
    words = line.split(separator)[:3]
    return len(words) == 3 and all(_is_number(word) for word in words)


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
