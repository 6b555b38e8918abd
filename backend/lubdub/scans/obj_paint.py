"""The colours of an OBJ: red, green and blue behind a vertex's place, or pictures named by its material file.

The geometry is read whatever becomes of the colours: what cannot be used of them is left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

import numpy as np

from lubdub.geometry.colour import Colouring
from lubdub.results import ScanUnreadable
from lubdub.scans.limits import LIMITS, fan
from lubdub.scans.pictures import Album
from lubdub.scans.reasons import unreadable
from lubdub.scans.tables import number_table
from lubdub.scans.unzip import Beside

_PLACE_LINE = re.compile(rb"^[ \t]*vt[ \t]+([^\r\n]*)", re.MULTILINE)
_LIBRARY_LINE = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]*)", re.MULTILINE)
_USE_LINE = re.compile(rb"^[ \t]*usemtl[ \t]+([^\r\n]*)", re.MULTILINE)
_USE_OR_FACE = re.compile(rb"^[ \t]*(?:usemtl[ \t]+([^\r\n]*)|f[ \t])", re.MULTILINE)
_CORNER = re.compile(rb"-?\d+/(\d*)(?:/-?\d*)?")
_FAR = 1e4


def vertex_colours(lines: Sequence[bytes]) -> np.ndarray | None:
    """(n, 3) uint8 from lines `x y z red green blue`, as shares of white or, by some writers, as bytes."""
    if len(lines[0].split()) < 6:
        return None
    try:
        colours = number_table(lines, (3, 4, 5))
    except ScanUnreadable:
        return None
    scale = 255.0 if not np.nanmax(colours) > 1.0 else 1.0
    return np.clip(np.nan_to_num(colours * scale), 0, 255).astype(np.uint8)


def painted(
    data: bytes, face_lines: Sequence[bytes], corner_counts: np.ndarray, vertices: np.ndarray | None, beside: Beside
) -> Colouring | None:
    """All colours of an OBJ, None when there are none. face_lines: as in the file; vertices: from vertex_colours.

    Triangles come in the order of `polygon_table`: polygons by their number of corners, each cut as `fan` does.
    """
    album, files = Album(), _pictures_named(data, beside)
    plain = None if vertices is None else Colouring(vertices)
    if not files or not face_lines:
        return plain
    used = {
        material: album.number(file, partial(beside.read, file, LIMITS.picture_bytes))
        for material, file in files.items()
    }
    if not album.pictures:
        return plain
    try:
        places = number_table(_PLACE_LINE.findall(data), (0, 1))
        corners, order = _corners(face_lines, corner_counts)
    except ScanUnreadable:
        return plain
    if not len(places) or corners.min() < 0 or corners.max() >= len(places) or not (np.abs(places) < _FAR).all():
        return plain
    laid = np.stack([places[:, 0], 1.0 - places[:, 1]], axis=1).astype(np.float32)
    numbers = _numbers(data, len(face_lines), used)[order]
    return Colouring(vertices, tuple(album.pictures), laid[corners], numbers)


def _pictures_named(data: bytes, beside: Beside) -> dict[bytes, str]:
    """Material -> file of its picture, from the material file that the OBJ names."""
    found = _LIBRARY_LINE.search(data)
    if found is None:
        return {}
    text = beside.read(found.group(1).decode("utf-8", "replace"), LIMITS.material_bytes) or b""
    pictures, material = {}, b""
    for line in text.splitlines():
        word, _, rest = line.strip().partition(b" ")
        if word == b"newmtl":
            material = rest.strip()
        elif word == b"map_Kd":
            name = rest.split()[-1] if rest.strip().startswith(b"-") else rest.strip()
            pictures[material] = name.decode("utf-8", "replace")
    return pictures


def _corners(lines: Sequence[bytes], corner_counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) which place each corner of a triangle has, from 0, and (m,) the line each triangle comes from."""
    corners, order = [], []
    for count in np.unique(corner_counts):
        rows = np.flatnonzero(corner_counts == count)
        chosen = _CORNER.sub(rb"\1", b"\n".join([lines[row] for row in rows.tolist()])).split(b"\n")
        if not chosen[0].strip():  # corners without a place in the picture
            raise unreadable("bad_face")
        corners.append(fan(number_table(chosen, range(int(count)), whole=True)))
        order.append(np.tile(rows, int(count) - 2))
    return np.concatenate(corners) - 1, np.concatenate(order)


def _numbers(data: bytes, face_count: int, used: dict[bytes, int | None]) -> np.ndarray:
    """(face_count,) int8 which picture each face line uses, -1 for none."""
    uses = _USE_LINE.findall(data)
    if len(uses) < 2:  # the usual case, without a walk over all lines
        number = used.get(uses[0].strip()) if uses else next(iter(used.values()))
        return np.full(face_count, -1 if number is None else number, np.int8)
    numbers, now, face = np.full(face_count, -1, np.int8), -1, 0
    for line in _USE_OR_FACE.finditer(data):
        if line.group(1) is not None:
            number = used.get(line.group(1).strip())
            now = -1 if number is None else number
        elif face < face_count:
            numbers[face] = now
            face += 1
    return numbers
