"""The same body from every kind of file is the same body."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial import cKDTree

from lubdub.geometry.surface import Surface
from lubdub.results import ScanUnreadable
from lubdub.scans.read import read_scan
from lubdub.scans.read_stl import join_equal
from lubdub.scans.reasons import MIRRORED_FILE
from tests.bodies import (
    pack_glb,
    rescale,
    torso_scan,
    write_glb,
    write_obj,
    write_pcd,
    write_ply,
    write_stl,
    write_xyz,
)

BODY = rescale(torso_scan(columns=40, rows=40), "m").surface
MESHES = {
    "ply little": write_ply(BODY),
    "ply big": write_ply(BODY, "binary_big_endian"),
    "ply text": write_ply(BODY, "ascii"),
    "stl binary": write_stl(BODY),
    "stl text": write_stl(BODY, ascii_text=True),
    "obj": write_obj(BODY),
    "glb": write_glb(BODY),
}
CLOUDS = {
    "pcd binary": write_pcd(BODY),
    "pcd text": write_pcd(BODY, "ascii"),
    "pcd packed": write_pcd(BODY, "binary_compressed"),
    "xyz": write_xyz(BODY),
    "xyz semicolons": write_xyz(BODY, ";"),
    "csv with a heading": write_xyz(BODY, ",", "x,y,z"),
    "pts with a count": write_xyz(BODY, " ", str(len(BODY.vertices))),
}


@pytest.mark.parametrize("name", [*MESHES, *CLOUDS])
def test_every_kind_of_file_gives_the_same_points(name: str) -> None:
    read = read_scan({**MESHES, **CLOUDS}[name]).surface
    assert len(read.vertices) == len(BODY.vertices)
    assert cKDTree(read.vertices).query(BODY.vertices)[0].max() < 1e-6
    assert cKDTree(BODY.vertices).query(read.vertices)[0].max() < 1e-6


@pytest.mark.parametrize("name", list(MESHES))
def test_meshes_keep_their_triangles_and_winding(name: str) -> None:
    read = read_scan(MESHES[name]).surface
    assert len(read.triangles) == len(BODY.triangles)
    middle = BODY.vertices.mean(axis=0)
    assert ((read.vertices - middle) * read.normals).sum() > 0


@pytest.mark.parametrize("name", list(CLOUDS))
def test_clouds_have_no_triangles(name: str) -> None:
    assert read_scan(CLOUDS[name]).surface.is_cloud


def test_the_kind_is_told_by_the_content() -> None:
    kinds = {name: read_scan(data).file_format for name, data in {**MESHES, **CLOUDS}.items()}
    assert all(name.startswith(kind) or kind == "xyz" for name, kind in kinds.items())


def test_only_glb_prescribes_a_unit() -> None:
    prescribed = {name: read_scan(data).unit_by_format for name, data in MESHES.items()}
    assert {name for name, unit in prescribed.items() if unit == "m"} == {"glb"}
    assert {unit for name, unit in prescribed.items() if name != "glb"} == {None}


def test_a_zip_with_one_obj_and_its_pictures_is_read() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("scan/textured.obj", MESHES["obj"])
        archive.writestr("scan/textured.mtl", "newmtl skin\n")
        archive.writestr("../../etc/picture.jpg", b"\xff\xd8\xff")
    assert len(read_scan(out.getvalue()).surface.triangles) == len(BODY.triangles)


def test_quads_and_larger_polygons_become_triangles() -> None:
    corners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 2 0\n"
    obj = "\n".join("v " + row for row in corners.split("\n") if row) + "\nf 1/1/1 2/2/2 3//3 4\nf 1 2 3 5 4\n"
    assert len(read_scan(obj.encode()).surface.triangles) == 5
    ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    ply += "element face 2\nproperty list uchar int vertex_indices\nend_header\n" + corners + "4 0 1 2 3\n5 0 1 2 4 3\n"
    assert len(read_scan(ply.encode()).surface.triangles) == 5


def test_binary_ply_with_polygons_of_different_lengths_is_read() -> None:
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty double x\nproperty double y\n"
    head += "property double z\nproperty uchar red\nelement face 3\nproperty uchar flags\n"
    head += "property list uchar uint vertex_index\nproperty list uchar float texcoord\nend_header\n"
    vertices = np.zeros(5, [("p", "<f8", 3), ("red", "u1")])
    vertices["p"] = np.arange(15).reshape(5, 3)
    faces = b""
    for corners in ([0, 1, 2], [0, 1, 2, 3], [4, 3, 2]):
        faces += bytes([7, len(corners)]) + np.array(corners, "<u4").tobytes() + bytes([2]) + bytes(8)
    read = read_scan(head.encode() + vertices.tobytes() + faces).surface
    assert np.array_equal(read.vertices, np.arange(15).reshape(5, 3))
    assert sorted(map(tuple, read.triangles)) == [(0, 1, 2), (0, 1, 2), (0, 2, 3), (4, 3, 2)]


def test_columns_behind_the_coordinates_are_left_alone() -> None:
    rows = "".join(f"{x} {y} {x * y} 255 0 0\n" for x in range(10) for y in range(10))
    assert len(read_scan(rows.encode()).surface.vertices) == 100


def test_a_glb_is_carried_to_where_its_node_puts_it() -> None:
    matrix = np.array([[0, -2.0, 0, 1], [2, 0, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
    read = read_scan(write_glb(BODY, matrix))
    expected = BODY.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.abs(read.surface.vertices - expected).max() < 1e-5
    assert read.warnings == ()


def test_a_mirroring_glb_node_is_kept_and_warned_of() -> None:
    read = read_scan(write_glb(BODY, np.diag([-1.0, 1, 1, 1])))
    assert np.abs(read.surface.vertices - BODY.vertices * [-1, 1, 1]).max() < 1e-5
    assert read.warnings == (MIRRORED_FILE,)


def test_glb_strips_become_triangles_with_one_winding() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]], "<f4")
    document = {
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": positions.nbytes}],
        "buffers": [{"byteLength": positions.nbytes}],
    }
    read = read_scan(pack_glb(document, positions.tobytes())).surface
    assert len(read.triangles) == 3
    assert (read.normals[:, 2] > 0).all()


def test_pcd_points_without_a_measurement_are_left_out() -> None:
    head = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 2\nPOINTS 4\nDATA ascii\n"
    assert len(read_scan((head + "0 0 0\nnan nan nan\n1 1 1\n2 2 2\n").encode()).surface.vertices) == 3


def test_joining_equal_corners_is_exact() -> None:
    rng = np.random.default_rng(0)
    corners = rng.integers(0, 6, (4000, 3)).astype(np.float32)
    corners[::7] = np.nextafter(corners[::7], np.float32(9))
    points, index = join_equal(corners)
    assert np.array_equal(points[index].astype(np.float32), corners)
    assert len(points) == len(np.unique(corners, axis=0))


def test_an_unreadable_file_says_so_in_a_sentence() -> None:
    with pytest.raises(ScanUnreadable, match=r"^[A-Z].*\.$"):
        read_scan(b"\x00\x01\x02 nothing of ours")


def test_a_large_mesh_keeps_every_vertex() -> None:
    dense = torso_scan(columns=400, rows=300).surface
    read = read_scan(write_stl(Surface(dense.vertices.astype(np.float32), dense.triangles))).surface
    assert len(read.vertices) == len(dense.vertices)


@pytest.mark.parametrize("write", [write_ply, write_obj, write_glb])
def test_triangles_with_corners_of_their_own_are_joined_again(write: Callable[[Surface], bytes]) -> None:
    corners = BODY.triangles.ravel()
    apart = Surface(BODY.vertices[corners], np.arange(len(corners)).reshape(-1, 3))
    read = read_scan(write(apart)).surface
    assert len(read.vertices) == len(BODY.vertices)
    assert np.abs(read.vertices[read.triangles] - BODY.vertices[BODY.triangles]).max() < 1e-6
