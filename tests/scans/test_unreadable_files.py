"""Damaged, hostile and foreign files end in one sentence, never in a crash."""

from __future__ import annotations

import gzip
import io
import json
import zipfile

import numpy as np
import pytest

from lubdub.results import ScanUnreadable
from lubdub.scans.limits import LIMITS
from lubdub.scans.read import read_scan
from lubdub.scans.reasons import UNREADABLE
from tests.bodies import (
    pack_glb,
    torso_scan,
    write_glb,
    write_obj,
    write_pcd,
    write_ply,
    write_stl,
    write_xyz,
)

SMALL = torso_scan(columns=12, rows=8).surface
_PLY_HEAD = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
_PLY_FACE = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"


def zipped(**files: bytes) -> bytes:
    """A ZIP with these files; `__` in a name stands for a dot."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name.replace("__", "."), content)
    return out.getvalue()


FOREIGN = {
    "empty": [b"", b"\0" * 100, b"  \n"],
    "picture": [b"\xff\xd8\xff\xe0JFIF", b"\x89PNG\r\n\x1a\n", b"\0\0\0\x18ftypheic", b"RIFF\0\0\0\0WEBP"],
    "video": [b"\0\0\0\x18ftypqt  ", b"\0\0\0\x18ftypmp42", b"\x1aE\xdf\xa3abc"],
    "pdf": [b"%PDF-1.7"],
    "page": [b"<!DOCTYPE html><html></html>", b"<html><body>Not found</body></html>"],
    "usdz": [zipped(scan__usdc=b"PXR-USDC"), b"PXR-USDC\0\0"],
    "gltf_text": [b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin"}]}'],
    "fbx": [b"Kaydara FBX Binary  \0"],
    "las": [b"LASF\0\0"],
    "e57": [b"ASTM-E57\0"],
    "dae": [b'<?xml version="1.0"?><COLLADA xmlns="x"></COLLADA>'],
    "3mf": [zipped(**{"3D/3dmodel__model": b"<model/>"})],
    "off": [b"OFF\n3 1 0\n"],
    "record3d": [zipped(**{"metadata": b"{}", "rgbd/0__jpg": b"x"})],
    "splat": [
        (_PLY_HEAD + "property float f_dc_0\nproperty float opacity\nend_header\n").encode(),
        gzip.compress(b"NGSP" + bytes(60)),
    ],
    "packed": [gzip.compress(b"something"), b"7z\xbc\xaf\x27\x1c", b"Rar!\x1a\x07"],
    "zip_none": [zipped(readme__txt=b"hello")],
    "zip_many": [zipped(a__obj=b"v 0 0 0\n", b__obj=b"v 0 0 0\n")],
    "zip_unsafe": [
        zipped(bomb__obj=b"v 0 0 0\n" * 2_000_000),
        zipped(nested__obj=zipped(inner__obj=b"v 0 0 0\n")),
        zipped(scan__obj=b"v 0 0 0\n" * 50)[:-30],
        zipped(**{f"f{i}__txt": b"x" for i in range(100)}),
    ],
}


@pytest.mark.parametrize(
    ("what", "data"),
    [
        pytest.param(what, data, id=f"{what} {number}")
        for what, files in FOREIGN.items()
        for number, data in enumerate(files, 1)
    ],
)
def test_a_foreign_file_is_named_for_what_it_is(what: str, data: bytes) -> None:
    with pytest.raises(ScanUnreadable) as caught:
        read_scan(data)
    assert caught.value.reason == UNREADABLE[what]


DAMAGED = {
    "face of no corners": _PLY_HEAD + _PLY_FACE + "0\n",
    "face of two corners": _PLY_HEAD + _PLY_FACE + "2 0 1\n",
    "index far away": _PLY_HEAD + _PLY_FACE + "3 0 1 99999999\n",
    "negative index": _PLY_HEAD + _PLY_FACE + "3 0 1 -7\n",
    "negative length": _PLY_HEAD + _PLY_FACE + "-3 0 1 2\n",
    "endless polygon": _PLY_HEAD + _PLY_FACE + "1000000 0 1 2\n",
    "vertex missing": _PLY_HEAD + "end_header\n0 0 0\n1 0 0\n",
    "nan": _PLY_HEAD + "end_header\n0 0 0\n1 nan 0\n0 1 0\n",
    "infinite": _PLY_HEAD + "end_header\n0 0 0\n1 1e999 0\n0 1 0\n",
    "far beyond": _PLY_HEAD + "end_header\n0 0 0\n1 1e8 0\n0 1 0\n",
    "words for numbers": _PLY_HEAD + "end_header\n0 0 0\n1 zero 0\n0 1 0\n",
    "no such type": "ply\nformat ascii 1.0\nelement vertex 3\nproperty quaternion x\nend_header\n",
    "no coordinates": "ply\nformat ascii 1.0\nelement vertex 1\nproperty float r\nend_header\n1\n",
    "claims too much": _PLY_HEAD.replace("vertex 3", "vertex 4000000000000") + "end_header\n0 0 0\n",
    "no points": _PLY_HEAD.replace("vertex 3", "vertex 0") + "end_header\n",
    "header without end": _PLY_HEAD,
    "negative count": _PLY_HEAD.replace("vertex 3", "vertex -3") + "end_header\n",
    "obj index beyond": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
    "obj index zero": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
    "obj index below zero": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -7\n",
    "obj nan": "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "obj without points": "o nothing\ns off\n",
    "obj edge": "v 0 0 0\nv 1 0 0\nf 1 2\n",
    "pcd claims too much": "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4000000000000\n"
    "HEIGHT 1\nPOINTS 4000000000000\nDATA binary\n\0\0\0",
    "pcd claims a little too much": "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 90\n"
    "HEIGHT 1\nPOINTS 90\nDATA binary\n\0\0\0",
    "pcd strange size": "VERSION .7\nFIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
    "POINTS 1\nDATA ascii\n1 2 3\n",
    "pcd only nan": "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
    "DATA ascii\nnan nan nan\n",
    "xyz with words": "1 2 3\n4 5 6\n7 8 nine\n",
    "stl without end": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n",
    "stl with words": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 x 0\nvertex 0 1 0\nendsolid\n",
}


@pytest.mark.parametrize("name", list(DAMAGED))
def test_a_damaged_file_is_refused(name: str) -> None:
    with pytest.raises(ScanUnreadable):
        read_scan(DAMAGED[name].encode())


def glb_document(**changes: object) -> dict[str, object]:
    """A small sound document with some parts replaced."""
    document: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    }
    return {**document, **changes}


BAD_GLB = {
    "compressed": glb_document(extensionsRequired=["KHR_draco_mesh_compression"]),
    "other file": glb_document(buffers=[{"byteLength": 36, "uri": "../secret.bin"}]),
    "ring of nodes": glb_document(nodes=[{"mesh": 0, "children": [0]}]),
    "node beyond": glb_document(nodes=[{"children": [7]}]),
    "accessor beyond": glb_document(meshes=[{"primitives": [{"attributes": {"POSITION": 9}}]}]),
    "count too large": glb_document(
        accessors=[{"bufferView": 0, "componentType": 5126, "count": 4_000_000_000_000, "type": "VEC3"}]
    ),
    "count a little too large": glb_document(
        accessors=[{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}]
    ),
    "negative offset": glb_document(bufferViews=[{"buffer": 0, "byteLength": 36, "byteOffset": -36}]),
    "accessor from nowhere": glb_document(accessors=[{"componentType": 5126, "count": 3, "type": "VEC3"}]),
    "nothing in it": glb_document(meshes=[{"primitives": []}]),
    "matrix of nan": glb_document(nodes=[{"mesh": 0, "matrix": [float("nan")] * 16}]),
    "turn of nothing": glb_document(nodes=[{"mesh": 0, "rotation": [0, 0, 0, 0]}]),
    "numbers for names": glb_document(meshes=[3]),
    "a word for a list": glb_document(nodes="many"),
}


@pytest.mark.parametrize("name", list(BAD_GLB))
def test_a_bad_glb_is_refused(name: str) -> None:
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    assert len(read_scan(pack_glb(glb_document(), triangle)).surface.triangles) == 1
    with pytest.raises(ScanUnreadable):
        read_scan(pack_glb(BAD_GLB[name], triangle))


def test_a_deeply_nested_glb_document_is_refused() -> None:
    data = pack_glb({"asset": 1}, b"")
    deep = b"[" * 200_000
    with pytest.raises(ScanUnreadable):
        read_scan(data[:12] + len(deep).to_bytes(4, "little") + b"JSON" + deep)
    assert json.loads(b"[" * 3 + b"]" * 3) == [[[]]]


def test_a_file_beyond_the_cap_is_refused_before_it_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lubdub.scans.read.LIMITS", type(LIMITS)(file_bytes=10))
    with pytest.raises(ScanUnreadable, match="300 MB"):
        read_scan(b"v 0 0 0\nv 1 1 1\n")


WRITTEN = {
    "ply": write_ply(SMALL),
    "ply text": write_ply(SMALL, "ascii"),
    "stl": write_stl(SMALL),
    "stl text": write_stl(SMALL, ascii_text=True),
    "obj": write_obj(SMALL),
    "glb": write_glb(SMALL),
    "pcd": write_pcd(SMALL),
    "pcd text": write_pcd(SMALL, "ascii"),
    "pcd packed": write_pcd(SMALL, "binary_compressed"),
    "xyz": write_xyz(SMALL),
    "zip": zipped(body__obj=write_obj(SMALL)),
}


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A few bytes changed, cut out, doubled or cut off; half the time near the beginning, where headers are."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        reach = min(len(out), 300) if rng.random() < 0.5 else len(out)
        place = int(rng.integers(0, max(reach, 1)))
        length = int(rng.integers(1, 12))
        kind = rng.integers(0, 5)
        if kind == 0:
            out[place : place + length] = rng.bytes(length)
        elif kind == 1:
            del out[place : place + length]
        elif kind == 2:
            out[place:place] = out[place : place + length]
        elif kind == 3:
            out[place : place + 1] = bytes(rng.choice(list(b"0123456789-.e \n")) for _ in range(length))
        else:
            del out[place + (len(out) - place) // 2 :]
    return bytes(out)


@pytest.mark.parametrize("name", list(WRITTEN))
def test_no_mutated_file_raises_anything_but_unreadable(name: str) -> None:
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(300):
        try:
            surface = read_scan(mutated(WRITTEN[name], rng)).surface
        except ScanUnreadable:
            refused += 1
            continue
        assert np.isfinite(surface.vertices).all()
        assert surface.is_cloud or 0 <= surface.triangles.min() <= surface.triangles.max() < len(surface.vertices)
    assert refused > 20
