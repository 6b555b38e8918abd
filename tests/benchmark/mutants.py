"""Broken files without end: one small body in every kind of file that we read, and five ways to damage each."""

from __future__ import annotations

import functools
import io
import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from PIL import Image

from lubdub.geometry.colour import Colouring
from tests.bodies import torso_scan
from tests.writers import write_glb, write_obj, write_pcd, write_ply, write_stl, write_textured_glb, write_xyz

HEAD_BYTES = 600
"""Where headers are; half of all damage is done there."""
NUMBERS = (b"0", b"1", b"-1", b"2147483647", b"4294967296", b"1000000000000", b"1e308", b"nan", b"0.5", b"")
LENGTHS = (0, 1, 2**16, 2**31 - 1, 2**31, 2**32 - 1)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Mutant:
    """One damaged file. how: the kind of damage."""

    data: bytes
    how: str


@functools.cache
def originals() -> Mapping[str, bytes]:
    """One body of 1,200 points, in millimetres, in every kind of file."""
    body = torso_scan(columns=40, rows=30).surface
    picture = np.random.default_rng(1).integers(0, 255, (16, 16, 3), np.uint8)
    places = np.random.default_rng(2).random((len(body.triangles), 3, 2)).astype(np.float32)
    colouring = Colouring(None, (picture,), places, np.zeros(len(body.triangles), np.int8))
    return {
        "ply": write_ply(body),
        "ply, other byte order": write_ply(body, "binary_big_endian"),
        "ply, text": write_ply(body, "ascii"),
        "stl": write_stl(body),
        "stl, text": write_stl(body, ascii_text=True),
        "obj": write_obj(body),
        "obj, zipped with material": _zipped_obj(write_obj(body), picture),
        "glb": write_glb(body),
        "glb, with picture": write_textured_glb(body, colouring),
        "pcd": write_pcd(body),
        "pcd, text": write_pcd(body, "ascii"),
        "pcd, packed": write_pcd(body, "binary_compressed"),
        "xyz": write_xyz(body),
        "csv": write_xyz(body, ",", "x,y,z"),
    }


def _zipped_obj(scan: bytes, picture: np.ndarray) -> bytes:
    skin = io.BytesIO()
    Image.fromarray(picture).save(skin, "PNG")
    files = {
        "body.obj": b"mtllib body.mtl\nusemtl skin\n" + scan,
        "body.mtl": b"newmtl skin\nmap_Kd skin.png\n",
        "skin.png": skin.getvalue(),
    }
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return out.getvalue()


def mutant(seed: int, kind: str, number: int) -> Mutant:
    """Always the same for the same three words: a finding is repeated by naming them."""
    place = list(originals()).index(kind)
    random = np.random.default_rng([seed, place, number])
    how = list(DAMAGES)[number % len(DAMAGES)]
    data = originals()[kind]
    for _ in range(int(random.integers(1, 4))):
        data = DAMAGES[how](data, random)
    return Mutant(data, how)


def _somewhere(data: bytes, random: np.random.Generator) -> int:
    reach = min(len(data), HEAD_BYTES) if random.random() < 0.5 else len(data)
    return int(random.integers(0, max(reach, 1)))


def _flipped(data: bytes, random: np.random.Generator) -> bytes:
    out = bytearray(data)
    for _ in range(int(random.integers(1, 9))):
        if out:
            out[_somewhere(data, random)] ^= 1 << int(random.integers(0, 8))
    return bytes(out)


def _cut(data: bytes, random: np.random.Generator) -> bytes:
    return data[: _somewhere(data, random)]


def _renumbered(data: bytes, random: np.random.Generator) -> bytes:
    """A written number exchanged, in the head or anywhere."""
    start = _somewhere(data, random)
    found = _NUMBER.search(data, start) or _NUMBER.search(data)
    if found is None:
        return _length_edited(data, random)
    new = NUMBERS[int(random.integers(0, len(NUMBERS)))]
    if random.random() < 0.3 and found.group().isdigit():
        new = str(int(found.group()) + int(random.integers(-2, 3))).encode()
    return data[: found.start()] + new + data[found.end() :]


def _spliced(data: bytes, random: np.random.Generator) -> bytes:
    """A piece of this file, or of another kind of file, put in, put over, or taken out."""
    kinds = list(originals())
    giver = data if random.random() < 0.6 else originals()[kinds[int(random.integers(0, len(kinds)))]]
    length = int(random.integers(1, max(len(giver) // 4, 2)))
    taken = int(random.integers(0, max(len(giver) - length, 1)))
    piece, place = giver[taken : taken + length], _somewhere(data, random)
    way = random.integers(0, 3)
    if way == 0:
        return data[:place] + piece + data[place:]
    if way == 1:
        return data[:place] + piece + data[place + length :]
    return data[:place] + data[place + length :]


def _length_edited(data: bytes, random: np.random.Generator) -> bytes:
    """A binary word of 1, 2 or 4 bytes exchanged, most often one that counts something."""
    width = int(random.choice([1, 2, 4, 4]))
    place = _somewhere(data, random) // width * width
    if place + width > len(data):
        return _cut(data, random)
    old = int.from_bytes(data[place : place + width], "little")
    new = LENGTHS[int(random.integers(0, len(LENGTHS)))] if random.random() < 0.5 else old + int(random.integers(-2, 3))
    return data[:place] + (new % 256**width).to_bytes(width, "little") + data[place + width :]


DAMAGES: Mapping[str, Callable[[bytes, np.random.Generator], bytes]] = {
    "bits flipped": _flipped,
    "cut short": _cut,
    "numbers changed": _renumbered,
    "pieces spliced": _spliced,
    "lengths edited": _length_edited,
}
