"""How much a file may ask of us before we stop reading it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.scans.reasons import unreadable


@dataclass(frozen=True)
class ReadingLimits:
    """Caps, all far above any phone or handheld scan of one chest (those have up to 1.5 million faces)."""

    file_bytes: int = 300_000_000
    header_bytes: int = 65_536
    """PLY and PCD headers of scanning apps stay under 2 kB, with long comments under 20 kB."""
    vertices: int = 5_000_000
    faces: int = 10_000_000
    corners: int = 64
    """Corners of one polygon; exporters write triangles and quads."""
    coordinate: float = 1e7
    """In file units: 10 km in millimetres. Beyond it, single precision holds no body any more."""
    zip_entries: int = 64
    zip_ratio: float = 200.0
    """Unpacked over packed size; the text of an OBJ packs about 4 to 10 times."""
    glb_document_bytes: int = 8_000_000
    glb_nodes: int = 20_000
    picture_bytes: int = 60_000_000
    picture_pixels: int = 70_000_000
    """8192 x 8192, the largest texture that phones and their apps make."""
    picture_side: int = 4096
    """Larger ones are made smaller: over a chest this is a pixel every quarter of a millimetre."""
    pictures: int = 16
    pictures_open: int = 100_000_000
    """Bytes of opened pictures after which no further one is opened; the largest takes 50 million itself."""
    material_bytes: int = 1_000_000


LIMITS = ReadingLimits()


def checked_surface(vertices: np.ndarray, triangles: np.ndarray) -> Surface:
    """A Surface, after the checks that keep later numerics safe.

    vertices: (n, 3) numbers; triangles: (m, 3) integers, m may be 0. Raises ScanUnreadable on too many or no
    points, numbers that are not finite or beyond reason, indices of vertices that are not there, and triangles
    that are all no more than a point.
    """
    if len(vertices) > LIMITS.vertices:
        raise unreadable("too_many_points")
    if len(triangles) > LIMITS.faces:
        raise unreadable("too_many_faces")
    if len(vertices) == 0:
        raise unreadable("no_points")
    if not (np.abs(vertices).max() < LIMITS.coordinate):  # also False for nan
        raise unreadable("bad_number")
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(vertices)):
        raise unreadable("bad_face")
    if len(triangles) and not (triangles[:, :1] != triangles[:, 1:]).any():
        raise unreadable("bad_face")
    return Surface(vertices, triangles)


def check_counts(vertices: int, faces: int = 0) -> None:
    """Raises ScanUnreadable when a header promises more than we take, before anything is made of it."""
    if vertices < 0 or faces < 0:
        raise unreadable("bad_header")
    if vertices > LIMITS.vertices:
        raise unreadable("too_many_points")
    if faces > LIMITS.faces:
        raise unreadable("too_many_faces")
    if vertices == 0:
        raise unreadable("no_points")


def check_rest(data: bytes, end: int) -> None:
    """Raises ScanUnreadable when something hangs behind the end: more points than the head says, or another file."""
    if data[end:].strip(b"\0 \t\r\n"):
        raise unreadable("too_long")


def fan(polygons: np.ndarray) -> np.ndarray:
    """Polygons of one length cut into triangles from their first corner. polygons: (k, n). Returns (k*(n-2), 3)."""
    corners = polygons.shape[1]
    if not 3 <= corners <= LIMITS.corners:
        raise unreadable("bad_face")
    cut = [polygons[:, [0, corner, corner + 1]] for corner in range(1, corners - 1)]
    return np.concatenate(cut).astype(np.int64)
