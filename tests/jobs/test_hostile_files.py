"""Hostile files through the real sandboxed child: each ends in one sentence at its first try, and the reader lives."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lubdub.geometry.surface import Surface
from lubdub.jobs.forkserver import ForkServer
from lubdub.jobs.sandbox import ChildResult, Limits
from tests.bodies import torso_scan
from tests.writers import pack_glb, write_glb, write_obj, write_pcd, write_ply, write_stl, write_xyz

BODY = torso_scan(columns=24, rows=20).surface
LIMITS = Limits(cpu_s=60, wall_s=240)


@pytest.fixture(scope="module")
def reader() -> Iterator[ForkServer]:
    """Started once: a reader that one of these files ended would have another process id at the end."""
    running = ForkServer(["tests.jobs.reading_task"])
    running.start()
    first = running.pid
    yield running
    assert running.pid == first
    running.stop()


def read(reader: ForkServer, scan: bytes) -> ChildResult:
    """What reading this file ends with."""
    return reader.run("tests.jobs.reading_task:read", scan, LIMITS, lambda stage, fraction: None)


def assert_refused(ended: ChildResult, *words: str) -> None:
    """Refused in one sentence and one piece of advice, not by a crash."""
    assert ended.status == "unreadable"
    reason = json.loads(ended.payload)
    assert reason["code"] == "unreadable_file"
    assert reason["message"].endswith(".")
    assert reason["advice"].endswith(".")
    assert all(word in reason["message"] for word in words), reason


def zipped(files: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


def bomb(name: str, unpacked: int) -> bytes:
    """A ZIP of a few kilobytes with one file of nothing but zeros."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive, archive.open(name, "w") as file:
        for _ in range(unpacked >> 20):
            file.write(bytes(1 << 20))
    return out.getvalue()


def lying_bomb() -> bytes:
    """A ZIP whose directory says 100 bytes where 64 megabytes come out."""
    data = bytearray(bomb("scan.obj", 64 << 20))
    directory = data.rindex(b"PK\x01\x02")
    struct.pack_into("<I", data, 22, 100)
    struct.pack_into("<I", data, directory + 24, 100)
    return bytes(data)


def overlapping_bomb() -> bytes:
    """A ZIP whose entries all point at the same packed bytes, so that every one unpacks to the same."""
    data = bytearray(zipped({f"part{number:02}.obj": b"v 0 0 0\n" * 1000 for number in range(60)}))
    for place in (found for found in range(len(data)) if data.startswith(b"PK\x01\x02", found)):
        struct.pack_into("<I", data, place + 42, 0)
    return bytes(data)


def test_a_zip_bomb_is_refused_before_it_is_unpacked(reader: ForkServer) -> None:
    assert_refused(read(reader, bomb("scan.obj", 64 << 20)), "not safe to unpack")


def test_a_zip_that_lies_about_its_size_is_not_unpacked_beyond_what_it_says(reader: ForkServer) -> None:
    assert_refused(read(reader, lying_bomb()), "not safe to unpack")


def test_a_zip_whose_files_overlap_is_refused(reader: ForkServer) -> None:
    assert_refused(read(reader, overlapping_bomb()), "more than one scan")


def test_a_picture_bomb_beside_a_scan_costs_the_colour_and_not_the_scan(reader: ForkServer) -> None:
    scan = b"mtllib body.mtl\nusemtl skin\n" + write_obj(BODY)
    files = {"body.obj": scan, "body.mtl": b"newmtl skin\nmap_Kd skin.png\n", "skin.png": picture_bomb()}
    assert read(reader, zipped(files)) == read(reader, write_obj(BODY))


def picture_bomb() -> bytes:
    """A PNG of a few hundred bytes that says it is 60,000 by 60,000 pixels."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(9999))) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize("name", ["scan.usdc", "scan.usda", "0/scan.usdz"])
def test_a_usdz_bomb_is_refused_by_its_name_alone(reader: ForkServer, name: str) -> None:
    assert_refused(read(reader, bomb(name, 64 << 20)), "ZIP" if name.endswith("z") else "USDZ")


@pytest.mark.parametrize("inner", ["scan.obj", "scan.zip", "again.zip"])
def test_an_archive_inside_an_archive_is_not_opened(reader: ForkServer, inner: str) -> None:
    nested = zipped({inner: zipped({"body.obj": write_obj(BODY)})}, zipfile.ZIP_STORED)
    assert_refused(read(reader, nested), "ZIP file")


PATHS = [
    "../../../etc/passwd.obj",
    "/etc/passwd.obj",
    "C:\\Windows\\body.obj",
    "a/../../body.obj",
    "con.obj",
    "a\nb.obj",
]


@pytest.mark.parametrize("path", PATHS)
def test_a_path_inside_an_archive_is_only_a_name(reader: ForkServer, path: str) -> None:
    assert read(reader, zipped({path: write_obj(BODY)})) == read(reader, write_obj(BODY))


@pytest.mark.parametrize("path", ["/etc/passwd", "../../../../etc/passwd", "file:///etc/passwd", "http://127.0.0.1/x"])
def test_a_material_that_names_a_file_of_the_machine_gets_nothing(reader: ForkServer, path: str) -> None:
    scan = f"mtllib {path}\nusemtl skin\n".encode() + write_obj(BODY)
    material = f"newmtl skin\nmap_Kd {path}\n".encode()
    files = {"body.obj": scan, "body.mtl": material}
    assert read(reader, zipped(files)) == read(reader, write_obj(BODY))


def test_a_link_inside_an_archive_is_not_followed(reader: ForkServer) -> None:
    link = zipfile.ZipInfo("body.obj")
    link.external_attr = 0o120777 << 16
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(link, "/etc/passwd")
    assert_refused(read(reader, out.getvalue()))


def unchecked(vertices: np.ndarray, triangles: np.ndarray) -> Any:
    """As a surface, but nobody looks whether it is one."""
    return SimpleNamespace(vertices=vertices, triangles=triangles, is_cloud=False)


def with_vertex(value: float) -> Any:
    vertices = BODY.vertices.copy()
    vertices[7, 1] = value
    return unchecked(vertices, BODY.triangles)


KINDS = {
    "ply": write_ply,
    "ply text": lambda surface: write_ply(surface, "ascii"),
    "ply other order": lambda surface: write_ply(surface, "binary_big_endian"),
    "stl": write_stl,
    "stl text": lambda surface: write_stl(surface, ascii_text=True),
    "obj": write_obj,
    "glb": write_glb,
    "pcd": write_pcd,
    "pcd text": lambda surface: write_pcd(surface, "ascii"),
    "xyz": write_xyz,
}


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e30", "-1e30", "3e38"])
@pytest.mark.parametrize("kind", list(KINDS))
def test_nan_and_huge_coordinates_are_refused(reader: ForkServer, kind: str, value: str) -> None:
    with np.errstate(over="ignore"):
        assert_refused(read(reader, KINDS[kind](with_vertex(float(value)))), "broken numbers")


INDEXED = {"ply": write_ply, "ply text": KINDS["ply text"], "obj": write_obj, "glb": write_glb}
INDICES = {"negative": -7, "huge": 2**31 - 2, "one beyond": len(BODY.vertices)}


@pytest.mark.parametrize("index", list(INDICES))
@pytest.mark.parametrize("kind", list(INDEXED))
def test_a_face_that_names_points_that_are_not_there_is_refused(reader: ForkServer, kind: str, index: str) -> None:
    triangles = BODY.triangles.copy()
    triangles[5, 2] = INDICES[index]
    assert_refused(read(reader, INDEXED[kind](unchecked(BODY.vertices, triangles))))


@pytest.mark.parametrize("kind", list(INDEXED))
def test_faces_that_all_name_the_same_point_are_no_body(reader: ForkServer, kind: str) -> None:
    ended = read(reader, INDEXED[kind](Surface(BODY.vertices, np.full_like(BODY.triangles, 3))))
    assert_refused(ended)


TRILLION = 10**12
CLAIMS = {
    "ply": f"ply\nformat binary_little_endian 1.0\nelement vertex {TRILLION}\nproperty float x\nproperty float y\n"
    "property float z\nend_header\n",
    "ply text": f"ply\nformat ascii 1.0\nelement vertex {TRILLION}\nproperty float x\nproperty float y\n"
    "property float z\nend_header\n0 0 0\n",
    "ply faces": "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    f"property float z\nelement face {TRILLION}\nproperty list uchar int vertex_indices\nend_header\n" + "\0" * 12,
    "ply other element": f"ply\nformat binary_little_endian 1.0\nelement camera {TRILLION}\nproperty float a\n"
    "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + "\0" * 40,
    "ply list of lists": f"ply\nformat binary_little_endian 1.0\nelement junk {TRILLION}\nproperty list uint int a\n"
    "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + "\0" * 40,
    "pcd": f"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {TRILLION}\nHEIGHT 1\n"
    f"POINTS {TRILLION}\nDATA binary\n" + "\0" * 12,
    "pcd width by height": "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1000000\n"
    "HEIGHT 1000000\nDATA ascii\n0 0 0\n",
    "xyz count line": f"{TRILLION}\n0 0 0\n",
}


@pytest.mark.parametrize("kind", list(CLAIMS))
def test_a_header_that_claims_a_trillion_is_refused(reader: ForkServer, kind: str) -> None:
    assert_refused(read(reader, CLAIMS[kind].encode()))


def test_a_glb_that_claims_a_trillion_points_is_refused(reader: ForkServer) -> None:
    document = {
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": TRILLION, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    }
    assert_refused(read(reader, pack_glb(document, bytes(36))))


def test_a_binary_stl_that_claims_four_billion_faces_is_refused(reader: ForkServer) -> None:
    assert_refused(read(reader, bytes(80) + b"\xff\xff\xff\xff" + bytes(50 * 20)))


PAGE = b"<!DOCTYPE html><script>alert(1)</script>"
DOCUMENT = b"%PDF-1.7\n1 0 obj\n<<>>\nendobj\n"
POLYGLOTS = {
    "a picture that is also a ZIP with a scan": (
        b"\xff\xd8\xff\xe0JFIF" + zipped({"b.obj": write_obj(BODY)}),
        "picture",
    ),
    "a PDF that is also an OBJ": (DOCUMENT + write_obj(BODY), "PDF"),
    "a page that is also an OBJ": (PAGE + b"\n" + write_obj(BODY), "web page"),
    "a program that is also a ZIP": (b"MZ\x90\0" + zipped({"b.obj": write_obj(BODY)}), "kind of file"),
    "a packed archive that is also an OBJ": (b"Rar!\x1a\x07\n" + write_obj(BODY), "packed"),
    "a video that is also a GLB": (b"\0\0\0\x18ftypmp42" + write_glb(BODY), "video"),
}


@pytest.mark.parametrize("name", list(POLYGLOTS))
def test_a_file_that_is_two_things_at_once_is_named_for_its_beginning(reader: ForkServer, name: str) -> None:
    data, word = POLYGLOTS[name]
    assert_refused(read(reader, data), word)


SCAN_FIRST = {
    "a PLY that is also a ZIP": (write_ply(BODY), zipped({"evil.obj": b"v 0 0 0\n"})),
    "a PLY that is also a page": (write_ply(BODY, "ascii"), PAGE),
    "an STL that is also a PDF": (write_stl(BODY), DOCUMENT),
    "a GLB that is also a ZIP": (write_glb(BODY), zipped({"evil.obj": b"v 0 0 0\n"})),
}


@pytest.mark.parametrize("name", list(SCAN_FIRST))
def test_what_hangs_behind_a_scan_is_not_looked_at(reader: ForkServer, name: str) -> None:
    scan, tail = SCAN_FIRST[name]
    ended = read(reader, scan + tail)
    assert ended.status == "unreadable" or ended == read(reader, scan)
