"""From bytes to points: tell the kind of file by its content, then read it with the reader of that kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from lubdub.results import RawScan
from lubdub.scans.limits import LIMITS
from lubdub.scans.read_glb import read_glb
from lubdub.scans.read_obj import read_obj
from lubdub.scans.read_ply import read_ply
from lubdub.scans.read_points import read_pcd, read_xyz
from lubdub.scans.read_stl import read_stl
from lubdub.scans.reasons import unreadable
from lubdub.scans.sniff import Kind, sniff
from lubdub.scans.unzip import Beside, only_scan
from lubdub.scans.weld import welded

_READERS: Mapping[Kind, Callable[[bytes], RawScan]] = {
    "ply": read_ply,
    "stl": read_stl,
    "glb": read_glb,
    "pcd": read_pcd,
    "xyz": read_xyz,
}


def read_scan(data: bytes) -> RawScan:
    """The scan in a file, in the file's own coordinates and unit.

    Takes PLY, STL, OBJ, GLB, PCD, columns of text, and a ZIP that holds one of these. Raises ScanUnreadable,
    with one sentence for a person, for everything else and for every damaged file.
    """
    if len(data) > LIMITS.file_bytes:
        raise unreadable("too_large")
    kind = sniff(data)
    beside = Beside()
    if kind == "zip":
        data, beside = only_scan(data)
        kind = sniff(data)
        if kind == "zip":
            raise unreadable("zip_unsafe")
    with np.errstate(all="ignore"):  # a number that does not fit becomes inf or nan, and these are refused
        return welded(read_obj(data, beside) if kind == "obj" else _READERS[kind](data))
