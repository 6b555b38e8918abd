"""The head of a PLY file: which elements follow, how many, and how each is laid out."""

from __future__ import annotations

from dataclasses import dataclass

from lubdub.scans.limits import LIMITS
from lubdub.scans.reasons import unreadable

SCALARS = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
_BYTE_ORDER = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_MOST_LINES = 1000


@dataclass(frozen=True)
class Property:
    """One column. kind: numpy code such as "f4"; count_kind: the code of the length when it is a list."""

    name: str
    kind: str
    count_kind: str | None = None


@dataclass(frozen=True)
class Element:
    """One table of the file."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def has_list(self) -> bool:
        """True when rows may differ in length."""
        return any(one.count_kind for one in self.properties)


@dataclass(frozen=True)
class Header:
    """byte_order: "" for text, else "<" or ">"; body_start: where the tables begin."""

    byte_order: str
    elements: tuple[Element, ...]
    body_start: int


def read_header(data: bytes) -> Header:
    """Parse the head. Raises ScanUnreadable when it is not a head that we can trust."""
    lines, body_start = _lines(data)
    byte_order: str | None = None
    elements: list[Element] = []
    for words in (line.split() for line in lines[1:]):
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) == 3:
            byte_order = _BYTE_ORDER.get(words[1])
        elif words[0] == "element" and len(words) == 3:
            elements.append(Element(words[1], _count(words[2]), ()))
        elif words[0] == "property" and elements:
            last = elements[-1]
            elements[-1] = Element(last.name, last.count, (*last.properties, _property(words)))
        else:
            raise unreadable("bad_header")
    names = [element.name for element in elements]
    if byte_order is None or len(set(names)) != len(names):
        raise unreadable("bad_header")
    return Header(byte_order, tuple(elements), body_start)


def _lines(data: bytes) -> tuple[list[str], int]:
    marker = data.find(b"end_header", 0, LIMITS.header_bytes)
    if marker < 0:
        raise unreadable("bad_header")
    end = data.find(b"\n", marker, marker + 20)
    if end < 0:
        end = data.find(b"\r", marker, marker + 20)
    lines = data[:marker].decode("latin-1").splitlines()
    if end < 0 or not lines or len(lines) > _MOST_LINES:
        raise unreadable("bad_header")
    return lines, end + 1


def _count(word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 16):
        raise unreadable("bad_header")
    return int(word)


def _property(words: list[str]) -> Property:
    if len(words) == 3 and words[1] in SCALARS:
        return Property(words[2], SCALARS[words[1]])
    if len(words) == 5 and words[1] == "list" and words[2] in SCALARS and words[3] in SCALARS:
        count_kind = SCALARS[words[2]]
        if count_kind[0] != "f":
            return Property(words[4], SCALARS[words[3]], count_kind)
    raise unreadable("bad_header")
