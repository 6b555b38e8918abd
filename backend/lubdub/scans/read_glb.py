"""GLB, the binary form of glTF 2.0: positions and triangles of every mesh, carried to where its node puts it.

Metres by specification. Nothing outside the file is ever opened.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from lubdub.geometry.colour import Colouring
from lubdub.results import RawScan
from lubdub.scans.glb_accessors import Accessors
from lubdub.scans.glb_nodes import placed_meshes
from lubdub.scans.glb_paint import Paint
from lubdub.scans.limits import LIMITS, check_counts, check_rest, checked_surface
from lubdub.scans.reasons import MIRRORED_FILE, unreadable

_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6


def read_glb(data: bytes) -> RawScan:
    """Read a GLB. Raises ScanUnreadable when it is damaged, compressed, or leans on other files."""
    document, body = _chunks(data)
    if set(_COMPRESSED) & set(_strings(document.get("extensionsRequired", []))):
        raise unreadable("draco")
    try:
        vertices, triangles, mirrored, colouring = _geometry(document, body)
    except (KeyError, IndexError, TypeError, AttributeError, OverflowError, ValueError) as error:
        raise unreadable("bad_header") from error
    warnings = (MIRRORED_FILE,) if mirrored else ()
    return RawScan(checked_surface(vertices, triangles), "glb", "m", warnings, colouring)


def _strings(value: object) -> list[str]:
    return [one for one in value if isinstance(one, str)] if isinstance(value, list) else []


def _chunks(data: bytes) -> tuple[Mapping[str, Any], bytes]:
    """The document and the binary chunk behind it."""
    if len(data) < 20:
        raise unreadable("cut_short")
    _, version, length, text_length, text_kind = struct.unpack_from("<4sIII4s", data)
    if version != 2 or text_kind != b"JSON" or text_length > LIMITS.glb_document_bytes:
        raise unreadable("bad_header")
    if length > len(data) or 20 + text_length > length:
        raise unreadable("cut_short")
    check_rest(data, length)
    try:
        document = json.loads(data[20 : 20 + text_length])
    except (ValueError, RecursionError) as error:
        raise unreadable("bad_header") from error
    if not isinstance(document, dict):
        raise unreadable("bad_header")
    at = 20 + text_length
    if at + 8 > length:
        return document, b""
    body_length, body_kind = struct.unpack_from("<I4s", data, at)
    if body_kind != b"BIN\0" or at + 8 + body_length > length:
        raise unreadable("cut_short")
    check_rest(data, at + 8 + body_length)
    return document, data[at + 8 : at + 8 + body_length]


def _geometry(document: Mapping[str, Any], body: bytes) -> tuple[np.ndarray, np.ndarray, bool, Colouring | None]:
    accessors = Accessors(document, body)
    paint = Paint(document, accessors)
    all_vertices: list[np.ndarray] = []
    all_triangles: list[np.ndarray] = []
    mirrored, vertex_total, face_total = False, 0, 0
    for mesh_index, matrix in placed_meshes(document):
        for primitive, positions, triangles in _primitives(document["meshes"][mesh_index], accessors):
            check_counts(vertex_total + len(positions), face_total + len(triangles))
            all_vertices.append(positions @ matrix[:3, :3].T + matrix[:3, 3])
            all_triangles.append(triangles + vertex_total)
            paint.add(primitive, len(positions), triangles)
            vertex_total += len(positions)
            face_total += len(triangles)
            mirrored = mirrored or bool(np.linalg.det(matrix[:3, :3]) < 0)
    if not all_vertices:
        raise unreadable("no_points")
    return np.concatenate(all_vertices), np.concatenate(all_triangles), mirrored, paint.colouring()


def _primitives(
    mesh: Mapping[str, Any], accessors: Accessors
) -> Iterator[tuple[Mapping[str, Any], np.ndarray, np.ndarray]]:
    for primitive in mesh["primitives"]:
        if set(_COMPRESSED) & set(primitive.get("extensions", {})):
            raise unreadable("draco")
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_POINTS, _TRIANGLES, _STRIP, _FAN):
            continue  # lines show no skin
        positions = accessors.positions(primitive["attributes"]["POSITION"])
        index = np.arange(len(positions))
        if "indices" in primitive:
            index = accessors.indices(primitive["indices"])
        yield primitive, positions, _triangles(index, mode, len(positions))


def _triangles(index: np.ndarray, mode: int, vertex_count: int) -> np.ndarray:
    """(m, 3) triangles of the glTF 2.0 primitive modes, section 3.7.2.1 of its specification."""
    if mode == _POINTS:
        return np.zeros((0, 3), np.int64)
    if len(index) and index.max() >= vertex_count:
        raise unreadable("bad_face")
    if mode == _TRIANGLES:
        if len(index) % 3:
            raise unreadable("bad_face")
        return index.reshape(-1, 3)
    if len(index) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == _FAN:
        return np.stack([np.full(len(index) - 2, index[0]), index[1:-1], index[2:]], axis=1)
    strip = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    strip[1::2] = strip[1::2][:, [1, 0, 2]]
    return strip
