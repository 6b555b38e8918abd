"""The part of a check that meets a stranger's bytes, alone: read the scan, and answer with its geometry."""

from __future__ import annotations

from lubdub.jobs.bundle import Bundle
from lubdub.results import Progress
from lubdub.scans.read import read_scan


def read(payload: bytes, progress: Progress) -> bytes:
    """payload: the file. Parts out: vertices (float64), triangles (int64). Raises ScanUnreadable."""
    raw = read_scan(payload)
    parts = {"vertices": raw.surface.vertices.tobytes(), "triangles": raw.surface.triangles.tobytes()}
    return Bundle({"format": raw.file_format}, parts).to_bytes()
