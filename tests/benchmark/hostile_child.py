"""The child's side of `./lubdub benchmark hostile`: read damaged files, and say what was made of each.

Whether a verdict is right is asked of a second reader (trimesh, pypcd4), which shares no code with ours.
"""

from __future__ import annotations

import io
import json
import time
import zipfile
from typing import Any

import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.jobs.bundle import Bundle
from lubdub.results import Progress, ScanUnreadable
from lubdub.scans.read import read_scan
from tests.writers import pack_glb, unpack_glb

SAME_MM = 0.5
"""Closer than that, a point is where it was: scanners are not finer."""


def read_all(payload: bytes, progress: Progress) -> bytes:
    """Parts in: the original, and damaged files by number. Answers a list of [number, verdict, milliseconds]."""
    bundle = Bundle.from_bytes(payload)
    original = read_scan(bundle.parts["original"]).surface
    told = []
    for number, data in bundle.parts.items():
        if number != "original":
            started = time.perf_counter()
            verdict = verdict_on(data, original, str(bundle.facts["kind"]))
            told.append([int(number), verdict, round(1000 * (time.perf_counter() - started), 1)])
    return json.dumps(told).encode()


def verdict_on(data: bytes, original: Surface, kind: str) -> str:
    """refused; same; other: a sound file of another shape; or wrong: not what a second reader finds in it.

    Refused means one sentence with an advice. Anything else that is raised goes through, as it would in a job.
    """
    try:
        raw = read_scan(data)
    except ScanUnreadable as unreadable:
        is_sentence = bool(unreadable.reason.message.strip() and unreadable.reason.advice.strip())
        return "refused" if is_sentence else "wrong"
    if is_same(raw.surface, original):
        return "same"
    # Damage may make it another kind of file, such as plain columns after a lost head.
    as_taken = kind if kind.startswith(raw.file_format) or kind == "csv" else raw.file_format
    return "other" if is_confirmed(raw.surface, data, as_taken) else "wrong"


def is_same(one: Surface, other: Surface) -> bool:
    """The same triangles between points that moved by less than a scanner sees."""
    if one.vertices.shape != other.vertices.shape or not np.array_equal(one.triangles, other.triangles):
        return False
    return bool(np.linalg.norm(one.vertices - other.vertices, axis=1).max(initial=0) <= SAME_MM)


def is_confirmed(read: Surface, data: bytes, kind: str) -> bool:
    """Whether a second reader finds the same triangles, or the same points, in the same bytes."""
    try:
        points, triangles = _second_opinion(data, kind)
    except Exception:  # whatever it raises, it does not confirm
        return False
    if read.is_cloud or not len(triangles):
        return read.is_cloud and _alike(read.vertices, points)
    return _alike(_turned(read.vertices[read.triangles]), _turned(points[triangles]))


def _turned(triangles: np.ndarray) -> np.ndarray:
    """(k, 9) the three corners in their order, beginning with the least: which one comes first says nothing.

    Triangles with two corners at one place show nothing, and are left out.
    """
    triangles = triangles.astype("f4")
    following = np.roll(triangles, -1, axis=1)
    triangles = triangles[(triangles != following).any(axis=2).all(axis=1)]
    least = np.lexsort(np.moveaxis(triangles[:, :, ::-1], -1, 0), axis=1)[:, 0]
    order = (least[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, order[:, :, None], axis=1).reshape(-1, 9)


def _alike(one: np.ndarray, other: np.ndarray) -> bool:
    """The same rows in whatever order, to single precision."""
    if one.shape != other.shape:
        return False
    one, other = (rows[np.lexsort(rows.T[::-1])] for rows in (one.astype("f4"), other.astype("f4")))
    return bool(np.allclose(one, other, rtol=1e-4, atol=SAME_MM, equal_nan=True))


def _second_opinion(data: bytes, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) points and (m, 3) triangles."""
    form = kind.partition(",")[0]
    if "zipped" in kind:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            (name,) = (one for one in archive.namelist() if one.lower().endswith(".obj"))
            data = archive.read(name)
    if form == "pcd":
        return _by_pypcd4(data), np.zeros((0, 3), np.int64)
    if form in ("xyz", "csv"):
        return _by_columns(data, "," if form == "csv" else None), np.zeros((0, 3), np.int64)
    try:
        return _by_trimesh(data, form)
    except Exception:
        if form != "glb":
            raise
        return _by_trimesh(_without_paint(data), form)  # broken colours cost the colours, not the shape


def _without_paint(data: bytes) -> bytes:
    document, body = unpack_glb(data)
    accessors, needed = document["accessors"], {}
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            primitive.pop("material", None)
            primitive["attributes"] = {"POSITION": primitive["attributes"]["POSITION"]}
            needed = {number: accessors[number] for number in (primitive["indices"], *primitive["attributes"].values())}
    anyone = next(iter(needed.values()))
    document["accessors"] = [needed.get(number, anyone) for number in range(len(accessors))]
    kept = {name: part for name, part in document.items() if name not in ("images", "textures", "materials")}
    return pack_glb(kept, body)


def _by_trimesh(data: bytes, form: str) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    loaded: Any = trimesh.load(io.BytesIO(data), file_type=form, process=False, maintain_order=True)
    if isinstance(loaded, trimesh.Scene):
        loaded = loaded.to_geometry()
    triangles = getattr(loaded, "faces", np.zeros((0, 3), np.int64))
    return np.asarray(loaded.vertices, np.float64), np.asarray(triangles, np.int64)


def _by_pypcd4(data: bytes) -> np.ndarray:
    from pypcd4 import PointCloud

    points = PointCloud.from_fileobj(io.BufferedReader(io.BytesIO(data))).numpy(("x", "y", "z")).astype(np.float64)
    return points[~np.isnan(points).all(axis=1)]


def _by_columns(data: bytes, separator: str | None) -> np.ndarray:
    rows = []
    for line in data.decode("latin-1").splitlines():
        words = line.split(separator)[:3]
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            if rows:
                raise
    return np.array([row for row in rows if row], np.float64)
