"""A surface as the bytes of a file, in every kind that we read."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from PIL import Image

from lubdub.geometry.colour import Colouring
from lubdub.geometry.surface import Surface


def write_ply(surface: Surface, encoding: str = "binary_little_endian") -> bytes:
    """PLY; encoding: ascii, binary_little_endian or binary_big_endian."""
    lines = ["ply", f"format {encoding} 1.0", f"element vertex {len(surface.vertices)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    if not surface.is_cloud:
        lines += [f"element face {len(surface.triangles)}", "property list uchar int vertex_indices"]
    head = ("\n".join([*lines, "end_header"]) + "\n").encode()
    if encoding == "ascii":
        rows = [" ".join(f"{v:.9g}" for v in row) for row in surface.vertices]
        rows += ["3 " + " ".join(map(str, row)) for row in surface.triangles]
        return head + ("\n".join(rows) + "\n").encode()
    order = "<" if "little" in encoding else ">"
    faces = np.zeros(len(surface.triangles), [("n", "u1"), ("i", order + "i4", 3)])
    faces["n"], faces["i"] = 3, surface.triangles
    return head + surface.vertices.astype(order + "f4").tobytes() + faces.tobytes()


def write_stl(surface: Surface, ascii_text: bool = False) -> bytes:
    """STL; the triangles only, each with its own corners."""
    corners = surface.vertices[surface.triangles]
    if ascii_text:
        facets = (
            "facet normal 0 0 0\nouter loop\n"
            + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in triangle)
            + "endloop\nendfacet\n"
            for triangle in corners
        )
        return ("solid body\n" + "".join(facets) + "endsolid body\n").encode()
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = corners
    return b"body".ljust(80, b" ") + struct.pack("<I", len(rows)) + rows.tobytes()


def write_obj(surface: Surface) -> bytes:
    """OBJ, geometry only."""
    rows = ["v {:.9g} {:.9g} {:.9g}".format(*row) for row in surface.vertices]
    rows += ["f {} {} {}".format(*row) for row in surface.triangles + 1]
    return ("# body\n" + "\n".join(rows) + "\n").encode()


def write_glb(surface: Surface, node_matrix: np.ndarray | None = None) -> bytes:
    """GLB with one mesh (or one point primitive), its coordinates written as they are."""
    positions = surface.vertices.astype("<f4")
    indices = surface.triangles.astype("<u4").ravel()
    primitive: dict[str, object] = {"attributes": {"POSITION": 0}, "mode": 0 if surface.is_cloud else 4}
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes}]
    accessors: list[dict[str, object]] = [
        {
            "bufferView": 0,
            "componentType": 5126,
            "count": len(positions),
            "type": "VEC3",
            "min": positions.min(0).tolist(),
            "max": positions.max(0).tolist(),
        }
    ]
    if not surface.is_cloud:
        primitive["indices"] = 1
        views.append({"buffer": 0, "byteOffset": positions.nbytes, "byteLength": indices.nbytes})
        accessors.append({"bufferView": 1, "componentType": 5125, "count": len(indices), "type": "SCALAR"})
    node: dict[str, object] = {"mesh": 0}
    if node_matrix is not None:
        node["matrix"] = np.asarray(node_matrix, float).T.ravel().tolist()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": positions.nbytes + indices.nbytes * (not surface.is_cloud)}],
    }
    body = positions.tobytes() + (b"" if surface.is_cloud else indices.tobytes())
    return pack_glb(document, body)


def pack_glb(document: Mapping[str, object], body: bytes) -> bytes:
    """The GLB container around a glTF document and its binary chunk."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body += b"\0" * (-len(body) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write_pcd(surface: Surface, encoding: str = "binary") -> bytes:
    """PCD; encoding: ascii, binary or binary_compressed."""
    from pypcd4 import Encoding, PointCloud

    out = io.BytesIO()
    PointCloud.from_xyz_points(surface.vertices.astype(np.float32)).save(out, Encoding(encoding))
    return out.getvalue()


def write_xyz(surface: Surface, separator: str = " ", header: str = "") -> bytes:
    """Columns of text; header: a first line to put before them."""
    rows = [separator.join(f"{v:.9g}" for v in row) for row in surface.vertices]
    return ((header + "\n" if header else "") + "\n".join(rows) + "\n").encode()


def write_textured_glb(surface: Surface, colouring: Colouring) -> bytes:
    """GLB of a mesh under one picture, every triangle with corners of its own, as scanning apps write them."""
    assert colouring.corners is not None
    corners = np.arange(3 * len(surface.triangles)).reshape(-1, 3)
    apart = Surface(surface.vertices[surface.triangles].reshape(-1, 3), corners)
    document, body = unpack_glb(write_glb(apart))
    picture = io.BytesIO()
    Image.fromarray(colouring.pictures[0]).save(picture, "JPEG", quality=90)
    for content in (colouring.corners.reshape(-1, 2).astype("<f4").tobytes(), picture.getvalue()):
        view = {"buffer": 0, "byteOffset": len(body), "byteLength": len(content)}
        document["bufferViews"].append(view)
        body += content + b"\0" * (-len(content) % 4)
    places, image = len(document["bufferViews"]) - 2, len(document["bufferViews"]) - 1
    accessor = {"bufferView": places, "componentType": 5126, "count": corners.size, "type": "VEC2"}
    document["accessors"].append(accessor)
    primitive = document["meshes"][0]["primitives"][0]
    primitive["attributes"]["TEXCOORD_0"], primitive["material"] = len(document["accessors"]) - 1, 0
    document["images"] = [{"bufferView": image, "mimeType": "image/jpeg"}]
    document["textures"] = [{"source": 0}]
    document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    document["buffers"][0]["byteLength"] = len(body)
    return pack_glb(document, body)


def unpack_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The document and the binary chunk of a GLB written here."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]
