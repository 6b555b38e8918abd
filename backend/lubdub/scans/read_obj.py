"""Wavefront OBJ: the geometry, and its colours where they come with it; normals are left alone."""

from __future__ import annotations

import re

import numpy as np

from lubdub.results import RawScan
from lubdub.scans.limits import LIMITS, check_counts, checked_surface
from lubdub.scans.obj_paint import painted, vertex_colours
from lubdub.scans.reasons import unreadable
from lubdub.scans.tables import number_table, polygon_table
from lubdub.scans.unzip import Beside

_VERTEX_LINE = re.compile(rb"^[ \t]*v[ \t]+([^\r\n]*)", re.MULTILINE)
_FACE_LINE = re.compile(rb"^[ \t]*f[ \t]+([^\r\n]*)", re.MULTILINE)
_FIRST_WORD = re.compile(rb"^[ \t]*([^\s#]\S*)", re.MULTILINE)
_WORDS = frozenset(
    (
        b"v vt vn vp f fo l p o g s mg mtllib usemtl usemap maplib call csh deg bmat step cstype curv curv2 surf parm "
        b"trim hole scrv sp end con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech"
    ).split()
)
"""Every word of the format. Another one at the beginning of a line is damage, or another file in the middle of this."""
_COLUMNS = {3, 4, 6, 7}
"""A place, a place with its weight, and either with a colour behind."""
_TEXTURE_AND_NORMAL = re.compile(rb"/[0-9/-]*")
_CONTINUED = re.compile(rb"\\[ \t]*\r?\n")


def read_obj(data: bytes, beside: Beside | None = None) -> RawScan:
    """Read an OBJ. Raises ScanUnreadable when it is damaged or names vertices that are not there.

    beside: the files it came with, where its material and pictures are looked for.
    """
    if b"\\" in data:
        data = _CONTINUED.sub(b" ", data)
    if not _WORDS.issuperset(_FIRST_WORD.findall(data)):
        raise unreadable("bad_line")
    vertex_lines, face_lines = _VERTEX_LINE.findall(data), _FACE_LINE.findall(data)
    check_counts(len(vertex_lines), len(face_lines))
    if not {len(line.split()) for line in vertex_lines} <= _COLUMNS:
        raise unreadable("bad_number")
    vertices = number_table(vertex_lines, (0, 1, 2))
    triangles, corner_counts = _triangles(face_lines)
    surface = checked_surface(vertices, triangles)
    colours = vertex_colours(vertex_lines)
    return RawScan(surface, "obj", colouring=painted(data, face_lines, corner_counts, colours, beside or Beside()))


def _triangles(lines: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) triangles, and how many corners each line has."""
    if not lines:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    if any(b"/" in line for line in (lines[0], lines[len(lines) // 2], lines[-1])):
        lines = _TEXTURE_AND_NORMAL.sub(b"", b"\n".join(lines)).split(b"\n")
    corner_counts = np.array([len(line.split()) for line in lines])
    if corner_counts.min() < 3 or corner_counts.max() > LIMITS.corners:
        raise unreadable("bad_face")
    triangles = polygon_table(lines, corner_counts, first_column=0)
    # Indices start at 1. Negative ones count back from the last vertex read so far, which the exporters of
    # scanning apps never write; checked_surface refuses them as damage.
    return triangles - 1, corner_counts
