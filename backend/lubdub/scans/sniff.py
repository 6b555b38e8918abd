"""What kind of file this is, from its content; names and stated types are never looked at."""

from __future__ import annotations

import re
import zlib
from typing import Literal

from lubdub.scans import read_stl
from lubdub.scans.reasons import unreadable

Kind = Literal["ply", "stl", "obj", "glb", "pcd", "xyz", "zip"]

_LOOK = 65_536

# Beginnings of files that we know but do not read -> the key of what to say about them.
_KNOWN_UNREAD: tuple[tuple[bytes, str], ...] = (
    (b"\xff\xd8\xff", "picture"),
    (b"\x89PNG", "picture"),
    (b"GIF8", "picture"),
    (b"II*\0", "picture"),
    (b"MM\0*", "picture"),
    (b"\x1aE\xdf\xa3", "video"),
    (b"%PDF", "pdf"),
    (b"PXR-USDC", "usdz"),
    (b"#usda", "usdz"),
    (b"Kaydara FBX", "fbx"),
    (b"; FBX", "fbx"),
    (b"LASF", "las"),
    (b"ASTM-E57", "e57"),
    (b"NGSP", "splat"),
    (b"OFF\n", "off"),
    (b"OFF\r", "off"),
    (b"COFF", "off"),
    (b"Rar!", "packed"),
    (b"7z\xbc\xaf", "packed"),
    (b"BZh", "packed"),
    (b"\xfd7zXZ", "packed"),
)
_OBJ_WORDS = {b"v", b"vn", b"vt", b"f", b"o", b"g", b"mtllib", b"usemtl", b"s"}
_PCD_WORDS = (b"VERSION", b"FIELDS", b"# .PCD")
_NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?nan|[-+]?inf"
_ROW = re.compile(rb"^\s*(?:" + _NUMBER + rb")(?:[\s;,]+(?:" + _NUMBER + rb")){2}", re.IGNORECASE)


def sniff(data: bytes) -> Kind:
    """The kind of file. Raises ScanUnreadable, saying what it is, when we do not read that kind."""
    if not data.strip(b"\0 \t\r\n\xef\xbb\xbf"):
        raise unreadable("empty")
    start = data[:_LOOK]
    if re.match(rb"ply[ \t]*\r?\n|ply\r", start):
        return "ply"
    if start.startswith(b"glTF"):
        return "glb"
    if start.startswith(b"PK\x03\x04"):
        return "zip"
    _refuse_known(start)
    if _is_text(start):
        return _sniff_text(start)
    if any(start.lstrip().startswith(word) for word in _PCD_WORDS):
        return "pcd"
    if read_stl.looks_binary(data):
        return "stl"
    raise unreadable("unknown")


def _refuse_known(start: bytes) -> None:
    for beginning, what in _KNOWN_UNREAD:
        if start.startswith(beginning):
            raise unreadable(what)
    if start[:2] == b"\x1f\x8b":
        raise unreadable("splat" if _unpacked(start).startswith(b"NGSP") else "packed")  # SPZ is gzip inside
    if start[:4] == b"RIFF" and start[8:12] in (b"WEBP", b"AVI "):
        raise unreadable("picture" if start[8:12] == b"WEBP" else "video")
    if start[4:8] == b"ftyp":
        is_still = start[8:12] in (b"heic", b"heix", b"hevc", b"heim", b"mif1", b"msf1", b"avif")
        raise unreadable("picture" if is_still else "video")
    if start[128:132] == b"DICM":
        raise unreadable("dicom")


def _unpacked(start: bytes) -> bytes:
    try:
        return zlib.decompressobj(wbits=31).decompress(start, 16)
    except zlib.error:
        return b""


def _is_text(start: bytes) -> bool:
    strange = start.translate(None, delete=bytes(range(32, 127)) + b"\t\r\n\f" + bytes(range(128, 256)))
    return not strange


def _sniff_text(start: bytes) -> Kind:
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    lowered = text[:4096].lower()
    if lowered.startswith(b"{") and b'"asset"' in start:
        raise unreadable("gltf_text")
    if lowered.startswith((b"<!doctype html", b"<html")):
        raise unreadable("page")
    if lowered.startswith(b"<") and b"<collada" in lowered:
        raise unreadable("dae")
    if text.startswith(_PCD_WORDS):
        return "pcd"
    if lowered.startswith(b"solid") and b"facet" in lowered:
        return "stl"
    lines = [line for line in text.splitlines()[:400] if line.strip() and not line.lstrip().startswith((b"#", b"//"))]
    if any(line.split()[0] in _OBJ_WORDS for line in lines[:40]):
        return "obj"
    # The last line of the part looked at may be cut in the middle, the first ones may be a heading.
    rows = lines[:-1] if len(start) == _LOOK else lines
    if rows and sum(bool(_ROW.match(line)) for line in rows) >= max(len(rows) - 4, 1):
        return "xyz"
    raise unreadable("unknown")
