"""A scan keeps its colours, whatever file they come in, and no picture can harm the scan."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image

from lubdub.geometry.colour import Colouring, sampled
from lubdub.geometry.surface import Surface, cloud
from lubdub.results import RawScan
from lubdub.scans.limits import LIMITS
from lubdub.scans.pictures import Album, opened
from lubdub.scans.read import read_scan
from tests.bodies import pack_glb, write_glb, write_obj, write_ply

SQUARE = Surface(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]]))
COLOURS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [250, 250, 250]], np.uint8)
PLACES = SQUARE.vertices[:, :2].astype(np.float32)
"""Each corner of the square lies in the same corner of the picture, the picture's foot at y = 0."""
PICTURE = np.zeros((64, 64, 3), np.uint8)
PICTURE[:32, :32], PICTURE[:32, 32:] = (255, 0, 0), (0, 255, 0)
PICTURE[32:, :32], PICTURE[32:, 32:] = (0, 0, 255), (250, 250, 250)


def encoded(picture: np.ndarray, kind: str = "PNG") -> bytes:
    out = io.BytesIO()
    Image.fromarray(picture).save(out, kind)
    return out.getvalue()


def zipped(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


def ply(kinds: tuple[str, str, str], names: tuple[str, str, str], scale: float, text: bool = False) -> bytes:
    head = f"ply\nformat {'ascii' if text else 'binary_little_endian'} 1.0\nelement vertex 4\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += "".join(f"property {kind} {name}\n" for kind, name in zip(kinds, names, strict=True)) + "end_header\n"
    values = COLOURS * scale
    if text:
        rows = (
            f"{x} {y} {z} {r:g} {g:g} {b:g}\n" for (x, y, z), (r, g, b) in zip(SQUARE.vertices, values, strict=True)
        )
        return (head + "".join(rows)).encode()
    code = {"uchar": "u1", "ushort": "<u2", "float": "<f4"}
    table = np.zeros(4, [*((a, "<f4") for a in "xyz"), *((n, code[k]) for n, k in zip(names, kinds, strict=True))])
    for axis, column in zip("xyz", SQUARE.vertices.T, strict=True):
        table[axis] = column
    for name, column in zip(names, values.T, strict=True):
        table[name] = column
    return head.encode() + table.tobytes()


def obj_rows(colours: np.ndarray) -> bytes:
    return "\n".join("v {} {} {} {} {} {}".format(*row) for row in np.hstack([SQUARE.vertices, colours])).encode()


def coloured_glb(kind: str) -> bytes:
    shares = COLOURS / 255.0
    stored = {"float": shares.astype("<f4"), "byte": COLOURS, "word": (shares * 65535).round().astype("<u2")}[kind]
    stored = np.concatenate([stored, np.full((4, 1), stored.max(), stored.dtype)], axis=1)
    code = {"float": 5126, "byte": 5121, "word": 5123}[kind]
    return _with_attribute("COLOR_0", stored, code, "VEC4", {})


def textured_glb(picture: bytes, places: np.ndarray = PLACES) -> bytes:
    laid = np.stack([places[:, 0], 1 - places[:, 1]], axis=1).astype("<f4")
    return _with_attribute("TEXCOORD_0", laid, 5126, "VEC2", {"picture": picture})


def _with_attribute(name: str, values: np.ndarray, code: int, width: str, more: dict[str, bytes]) -> bytes:
    data = write_glb(SQUARE)
    length = struct.unpack_from("<I", data, 12)[0]
    document, body = json.loads(data[20 : 20 + length]), data[20 + length + 8 :]

    def add(content: bytes) -> int:
        nonlocal body
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(body), "byteLength": len(content)})
        body += content + b"\0" * (-len(content) % 4)
        return len(document["bufferViews"]) - 1

    primitive = document["meshes"][0]["primitives"][0]
    accessor = {"bufferView": add(values.tobytes()), "componentType": code, "count": len(values), "type": width}
    document["accessors"].append({**accessor, "normalized": code != 5126})
    primitive["attributes"][name] = len(document["accessors"]) - 1
    if more:
        document["images"] = [{"bufferView": add(more["picture"]), "mimeType": "image/png"}]
        document["textures"] = [{"source": 0}]
        document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
        primitive["material"] = 0
    document["buffers"][0]["byteLength"] = len(body)
    return pack_glb(document, body)


def textured_obj(picture: bytes, texture: str = "skin of chest.png", place: str = "{0}/{0}/{0}") -> bytes:
    rows = ["mtllib body.mtl"] + ["v {} {} {}".format(*row) for row in SQUARE.vertices]
    rows += ["vt {} {}".format(*row) for row in PLACES] + ["usemtl skin"]
    rows += ["f " + " ".join(place.format(corner + 1) for corner in row) for row in SQUARE.triangles]
    material = f"newmtl skin\nKd 1 1 1\nmap_Kd {texture}\n"
    files = {"scan/body.obj": "\n".join(rows).encode(), "scan/body.mtl": material.encode()}
    return zipped({**files, "scan/skin of chest.png": picture})


def colours_of(scan: RawScan, places: np.ndarray) -> np.ndarray:
    """The colour at places (k, 2) of the square."""
    assert scan.colouring is not None
    upper = places[:, 1] > places[:, 0]
    weights = np.where(
        upper[:, None],
        np.stack([1 - places[:, 1], places[:, 0], places[:, 1] - places[:, 0]], axis=1),
        np.stack([1 - places[:, 0], places[:, 0] - places[:, 1], places[:, 1]], axis=1),
    )
    return scan.colouring.at(scan.surface.triangles, upper.astype(int), weights)


VERTEX_COLOURED = {
    "ply bytes": ply(("uchar",) * 3, ("red", "green", "blue"), 1.0),
    "ply words": ply(("ushort",) * 3, ("red", "green", "blue"), 257.0),
    "ply shares": ply(("float",) * 3, ("r", "g", "b"), 1 / 255),
    "ply text": ply(("uchar",) * 3, ("diffuse_red", "diffuse_green", "diffuse_blue"), 1.0, text=True),
    "obj shares": obj_rows(COLOURS / 255),
    "obj bytes": obj_rows(COLOURS),
    "glb float": coloured_glb("float"),
    "glb byte": coloured_glb("byte"),
    "glb word": coloured_glb("word"),
}


@pytest.mark.parametrize("name", VERTEX_COLOURED)
def test_the_colours_of_vertices_are_kept(name: str) -> None:
    colouring = read_scan(VERTEX_COLOURED[name]).colouring
    assert colouring is not None
    assert colouring.vertices is not None
    assert np.abs(colouring.vertices.astype(int) - COLOURS).max() <= 1


TEXTURED: dict[str, Callable[[bytes], bytes]] = {"glb": textured_glb, "obj in a zip": textured_obj}


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
@pytest.mark.parametrize("name", TEXTURED)
def test_a_picture_lies_on_the_skin_the_right_way_round(name: str, kind: str) -> None:
    scan = read_scan(TEXTURED[name](encoded(PICTURE, kind)))
    middles = np.array([[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [0.75, 0.25]])
    seen = colours_of(scan, middles)
    assert np.abs(seen - [[255, 0, 0], [0, 255, 0], [0, 0, 255], [250, 250, 250]]).max() < 12


@pytest.mark.parametrize(
    "plain", [write_ply(SQUARE), write_obj(SQUARE), write_glb(SQUARE), write_ply(cloud(SQUARE.vertices))]
)
def test_a_scan_without_colour_carries_none(plain: bytes) -> None:
    assert read_scan(plain).colouring is None


def test_every_material_of_an_obj_has_its_own_picture_and_polygons_keep_theirs() -> None:
    rows = ["mtllib m.mtl"] + ["v {} {} {}".format(*row) for row in SQUARE.vertices] + ["v 2 0 0", "v 2 1 0"]
    rows += ["vt 0.5 0.5", "usemtl dark", "f 2/1 5/1 6/1 3/1", "usemtl light", "f 1/1 2/1 3/1", "f 1/1 3/1 4/1"]
    dark, light = (encoded(np.full((8, 8, 3), value, np.uint8)) for value in (20, 220))
    material = b"newmtl dark\nmap_Kd -s 1 1 1 tex\\dark.png\nnewmtl light\nmap_Kd LIGHT.png\n"
    scan = read_scan(
        zipped({"m.obj": "\n".join(rows).encode(), "m.mtl": material, "dark.png": dark, "light.png": light})
    )
    assert scan.colouring is not None
    middle = scan.surface.vertices[scan.surface.triangles].mean(axis=1)
    weights = np.full((len(middle), 3), 1 / 3)
    seen = scan.colouring.at(scan.surface.triangles, np.arange(len(middle)), weights)[:, 0]
    assert np.abs(seen - np.where(middle[:, 0] > 1, 20, 220)).max() < 1


def png_head(width: int, height: int) -> bytes:
    """A PNG of this size as its head has it, with next to nothing behind."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    )


HOSTILE = {
    "not a picture": b"hello" * 100,
    "empty": b"",
    "cut short": encoded(PICTURE, "PNG")[:90],
    "a bomb by its head": png_head(60_000, 60_000),
    "a head with nothing behind it": png_head(4_000, 4_000),
    "no pixels": png_head(0, 10),
    "another kind": encoded(PICTURE, "BMP"),
}


@pytest.mark.parametrize("container", TEXTURED)
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_picture_costs_the_colour_and_not_the_scan(name: str, container: str) -> None:
    scan = read_scan(TEXTURED[container](HOSTILE[name]))
    assert scan.colouring is None
    assert len(scan.surface.triangles) == 2


def test_a_bomb_is_told_by_its_head_before_a_pixel_is_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("unpacked")

    monkeypatch.setattr(Image.Image, "convert", never)
    side = int(LIMITS.picture_pixels**0.5) + 1
    assert opened(png_head(side, side)) is None


def test_a_very_large_picture_is_made_smaller() -> None:
    picture = opened(encoded(np.zeros((10, LIMITS.picture_side * 2, 3), np.uint8)))
    assert picture is not None
    assert picture.shape == (5, LIMITS.picture_side, 3)


def test_only_so_many_pictures_are_opened() -> None:
    album = Album()
    content = encoded(PICTURE)
    numbers = [album.number(name, lambda: content) for name in range(LIMITS.pictures + 5)]
    assert numbers == [*range(LIMITS.pictures), *[None] * 5]


@pytest.mark.parametrize(
    "obj",
    [
        textured_obj(encoded(PICTURE), texture="../../elsewhere/other.png"),
        textured_obj(encoded(PICTURE), place="{0}//{0}"),
        textured_obj(encoded(PICTURE), place="{0}/9/{0}"),
        textured_obj(encoded(PICTURE), place="{0}/0/{0}"),
    ],
)
def test_colours_that_lead_nowhere_are_left_out(obj: bytes) -> None:
    scan = read_scan(obj)
    assert scan.colouring is None
    assert len(scan.surface.triangles) == 2


@pytest.mark.parametrize("places", [PLACES + np.nan, PLACES + np.inf, PLACES + 1e30])
def test_impossible_places_in_a_picture_are_left_out(places: np.ndarray) -> None:
    assert read_scan(textured_glb(encoded(PICTURE), places)).colouring is None


def test_a_picture_repeats_beyond_its_edge() -> None:
    places = np.array([[0.3, 0.8], [0.9, 0.1]])
    assert np.array_equal(sampled(PICTURE, places), sampled(PICTURE, places + [2, -3]))


def test_places_without_a_picture_are_grey() -> None:
    nothing = Colouring(None, (PICTURE,), np.zeros((2, 3, 2), np.float32), np.array([-1, -1], np.int8))
    seen = nothing.at(SQUARE.triangles, np.array([0, 1]), np.full((2, 3), 1 / 3))
    assert (seen == 128).all()
