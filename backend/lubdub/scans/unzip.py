"""One scan out of a ZIP, as OBJ exporters pack it, and the material and pictures that lie beside it."""

from __future__ import annotations

import io
import zipfile
import zlib
from dataclasses import dataclass

from lubdub.results import ScanUnreadable
from lubdub.scans.limits import LIMITS
from lubdub.scans.reasons import unreadable

_SCANS = (".obj", ".ply", ".stl", ".glb", ".pcd", ".xyz")
_INSIDE_OTHERS = (
    (".usdc", "usdz"),
    (".usda", "usdz"),
    (".usd", "usdz"),
    (".r3d", "record3d"),
    ("3dmodel.model", "3mf"),
)


_DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError, ValueError)


@dataclass(frozen=True)
class Beside:
    """The other files of a ZIP, found by their bare names."""

    archive: bytes = b""

    def read(self, name: str, at_most: int) -> bytes | None:
        """The file of this name, whatever folder it lies in; None when it is missing, too large or damaged.

        name: bare or with folders, which are not looked at; upper and lower case are the same.
        """
        wanted = _bare(name)
        try:
            with zipfile.ZipFile(io.BytesIO(self.archive)) as archive:
                found = [entry for entry in archive.infolist() if _bare(entry.filename) == wanted]
                return _unpacked(archive, found[0]) if found and found[0].file_size <= at_most else None
        except (*_DAMAGE, ScanUnreadable):
            return None


def _bare(name: str) -> str:
    return name.replace("\\", "/").rsplit("/", 1)[-1].strip().lower()


def only_scan(data: bytes) -> tuple[bytes, Beside]:
    """The content of the one scan in a ZIP, and what lies beside it. Names inside are never used as paths.

    Raises ScanUnreadable when there is none or more than one, or when unpacking would not be safe.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entry = _the_scan(archive.infolist())
            return _unpacked(archive, entry), Beside(data)
    except _DAMAGE as error:
        raise unreadable("zip_unsafe") from error


def _the_scan(entries: list[zipfile.ZipInfo]) -> zipfile.ZipInfo:
    if len(entries) > LIMITS.zip_entries:
        raise unreadable("zip_unsafe")
    names = [entry.filename.lower() for entry in entries]
    for ending, what in _INSIDE_OTHERS:
        if any(name.endswith(ending) for name in names):
            raise unreadable(what)
    if any("rgbd/" in name for name in names):
        raise unreadable("record3d")
    scans = [
        entry
        for entry, name in zip(entries, names, strict=True)
        if name.endswith(_SCANS) and not name.startswith("__macosx/")
    ]
    if not scans:
        raise unreadable("zip_none")
    if len(scans) > 1:
        raise unreadable("zip_many")
    return scans[0]


def _unpacked(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    too_dense = entry.file_size > LIMITS.zip_ratio * max(entry.compress_size, 1)
    if entry.flag_bits & 1 or too_dense:
        raise unreadable("zip_unsafe")
    if entry.file_size > LIMITS.file_bytes:
        raise unreadable("too_large")
    with archive.open(entry) as content:
        unpacked = content.read(entry.file_size + 1)  # the stated size is a claim: never read past it
    if len(unpacked) != entry.file_size:
        raise unreadable("zip_unsafe")
    return unpacked
