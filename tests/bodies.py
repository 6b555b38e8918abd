"""Made-up torsos with exactly known landmarks, and the things that go wrong when somebody scans one.

A test builds a body, damages it step by step and writes it to bytes:

    scan = add_bed(hide_side(torso_scan(size=0.6)))
    data = write_ply(rescale(turn(scan, degrees=(5, 20, 0)), "m").surface)

Everything is in millimetres in the body frame until `rescale` and `turn`, which therefore come last.
Nothing here is random without a seed.
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import MM_PER_UNIT, Similarity
from lubdub.geometry.surface import Surface, cloud
from lubdub.results import AreaName, LandmarkName

BODY, BED, CLUTTER = 0, 1, 2
ADULT_STERNUM_MM = 150.0

# Height above the notch, half breadth, depth from back to front: an adult of average build, in millimetres.
_PROFILE = np.array(
    [
        [110.0, 55.0, 105.0],
        [60.0, 62.0, 108.0],
        [25.0, 110.0, 122.0],
        [0.0, 165.0, 150.0],
        [-60.0, 172.0, 190.0],
        [-150.0, 160.0, 212.0],
        [-260.0, 146.0, 205.0],
        [-370.0, 142.0, 192.0],
        [-480.0, 168.0, 200.0],
    ]
)
_ROUNDNESS = 2.6  # exponent of the superellipse: 2 is an ellipse, more is boxier


@dataclass(frozen=True)
class Shape:
    """A torso. size: 1 is an adult, 0.34 a newborn; breast, belly: 0 flat to 1 full; breadth: 1 is average."""

    size: float = 1.0
    breast: float = 0.15
    belly: float = 0.2
    breadth: float = 1.0

    def half_breadth(self, y: np.ndarray) -> np.ndarray:
        """Half the breadth at height y, both in millimetres."""
        return self.size * self.breadth * np.interp(y / self.size, _PROFILE[::-1, 0], _PROFILE[::-1, 1])

    def depth(self, y: np.ndarray) -> np.ndarray:
        """Back to front at height y."""
        return self.size * np.interp(y / self.size, _PROFILE[::-1, 0], _PROFILE[::-1, 2])

    def front_bumps(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """What breasts, nipples, belly and navel add to the front, in millimetres along +z."""
        s = self.size
        nipple = _nipple(self, 1.0)
        out = 38 * s * self.belly * _bell(x, y + 400 * s, 95 * s)
        out -= 7 * s * _bell(x, y + 367 * s, 8 * s)
        for side in (-1.0, 1.0):
            out += 45 * s * self.breast * _bell(x - side * nipple[0], y - nipple[1] - 12 * s, 48 * s)
            out += 4 * s * _bell(x - side * nipple[0], y - nipple[1], 6 * s)
        return out

    def front(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Height z of the front skin over (x, y)."""
        rim = np.clip(1 - np.abs(x / self.half_breadth(y)) ** _ROUNDNESS, 0, None) ** (1 / _ROUNDNESS)
        middle = self.depth(y) / 2 - 150.0 * self.size
        return middle + self.depth(y) / 2 * rim + self.front_bumps(x, y)


def _bell(x: np.ndarray, y: np.ndarray, width: float) -> np.ndarray:
    return np.asarray(np.exp(-(x * x + y * y) / (2 * width * width)))


def _nipple(shape: Shape, side: float) -> np.ndarray:
    return np.array([side * 95.0 * shape.breadth, -158.0]) * shape.size


@dataclass(frozen=True)
class BodyScan:
    """A scan whose truth is known. label: (n,) BODY, BED or CLUTTER for each vertex of surface."""

    surface: Surface
    label: np.ndarray
    landmarks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    file_from_body: Similarity = field(default_factory=Similarity.identity)


def torso_surface(shape: Shape, columns: int = 172, rows: int = 165) -> Surface:
    """The skin from hip to neck as a tube, open at both ends, wound outward."""
    y = np.linspace(_PROFILE[-1, 0], _PROFILE[0, 0], rows)[:, None] * shape.size
    across, out = _even_superellipse(columns)
    x = shape.half_breadth(y) * across
    half_depth = shape.depth(y) / 2
    z = half_depth - 150.0 * shape.size + half_depth * out
    z = z + shape.front_bumps(x, y) * np.clip(out * 4, 0, 1)
    vertices = np.stack(np.broadcast_arrays(x, y, z), 2).reshape(-1, 3)
    return Surface(vertices, _tube_triangles(rows, columns))


def _even_superellipse(columns: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit superellipse walked in even steps of an adult chest's girth; the front's middle is one of them."""
    angle = np.linspace(0, 2 * np.pi, 20001)
    power = 2 / _ROUNDNESS
    across = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    out = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    girth = np.concatenate([[0], np.cumsum(np.hypot(np.diff(across) * 1.6, np.diff(out)))])
    even = np.linspace(0, girth[-1], columns, endpoint=False)
    return np.interp(even, girth, across)[None, :], np.interp(even, girth, out)[None, :]


def _tube_triangles(rows: int, columns: int) -> np.ndarray:
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a = (row * columns + column).ravel()
    b = (row * columns + (column + 1) % columns).ravel()
    return np.concatenate([np.stack([a, a + columns, b], 1), np.stack([b, a + columns, b + columns], 1)])


def landmarks_of(shape: Shape) -> dict[LandmarkName, np.ndarray]:
    """The five landmarks, exactly on the skin."""
    s = shape.size
    left = _nipple(shape, 1.0)
    places: dict[LandmarkName, tuple[float, float]] = {
        "suprasternal_notch": (0.0, 0.0),
        "xiphisternum": (0.0, -ADULT_STERNUM_MM * s),
        "navel": (0.0, -367.0 * s),
        "nipple_left": (left[0], left[1]),
        "nipple_right": (-left[0], left[1]),
    }
    return {name: _on_front(shape, x, y) for name, (x, y) in places.items()}


def areas_of(shape: Shape) -> dict[AreaName, np.ndarray]:
    """The four areas by the ladder of sternum lengths for people of seven and over."""
    sternum = ADULT_STERNUM_MM * shape.size
    steps: dict[AreaName, tuple[float, float]] = {
        "aortic": (-0.17, -0.40),
        "pulmonary": (0.17, -0.40),
        "tricuspid": (0.22, -0.81),
        "mitral": (0.54, -1.06),
    }
    return {name: _on_front(shape, across * sternum, along * sternum) for name, (across, along) in steps.items()}


def _on_front(shape: Shape, x: float, y: float) -> np.ndarray:
    return np.array([x, y, float(shape.front(np.array(x), np.array(y)))])


def torso_scan(
    size: float = 1.0,
    breast: float = 0.15,
    belly: float = 0.2,
    breadth: float = 1.0,
    columns: int = 172,
    rows: int = 165,
    arms: bool = False,
) -> BodyScan:
    """A perfect scan of the whole way round, about 28,000 vertices by default, mesh, millimetres."""
    shape = Shape(size, breast, belly, breadth)
    surface = torso_surface(shape, columns, rows)
    if arms:
        surface = joined(surface, _arm(shape, 1.0), _arm(shape, -1.0))
    label = np.full(len(surface.vertices), BODY)
    return BodyScan(surface, label, landmarks_of(shape), areas_of(shape))


def _arm(shape: Shape, side: float) -> Surface:
    rows, columns, s = 90, 40, shape.size
    y = np.linspace(-330.0, -20.0, rows)[:, None] * s
    turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    middle = side * (shape.half_breadth(np.array(-60.0 * s)) + 22.0 * s - 0.12 * (y + 20 * s))
    x = middle + 42.0 * s * np.cos(turn)
    z = -95.0 * s + 42.0 * s * np.sin(turn)
    vertices = np.stack(np.broadcast_arrays(x, y, z), 2).reshape(-1, 3)
    return Surface(vertices, _tube_triangles(rows, columns))


def joined(*surfaces: Surface) -> Surface:
    """Several surfaces as one, not welded."""
    starts = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.triangles + start for s, start in zip(surfaces, starts, strict=True)]),
    )


def as_cloud(scan: BodyScan) -> BodyScan:
    """The same points without triangles."""
    return replace(scan, surface=cloud(scan.surface.vertices))


def kept(scan: BodyScan, keep: np.ndarray) -> BodyScan:
    """Only the vertices that are True in keep."""
    return replace(scan, surface=scan.surface.kept(keep), label=scan.label[keep])


def _with(scan: BodyScan, extra: Surface, label: int) -> BodyScan:
    both = joined(scan.surface, extra)
    if scan.surface.is_cloud:
        both = cloud(both.vertices)
    return replace(scan, surface=both, label=np.concatenate([scan.label, np.full(len(extra.vertices), label)]))


def _grid(x: np.ndarray, y: np.ndarray, z: float) -> Surface:
    plane_x, plane_y = np.meshgrid(x, y, indexing="ij")
    vertices = np.stack([plane_x, plane_y, np.full(plane_x.shape, z)], 2).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1), indexing="ij")
    a = (row * len(y) + column).ravel()
    b = a + len(y)
    return Surface(vertices, np.concatenate([np.stack([a, b, a + 1], 1), np.stack([b, b + 1, a + 1], 1)]))


def hide_side(scan: BodyScan, seen_from: tuple[float, float, float] = (0, 0, 1), grazing: float = 0.15) -> BodyScan:
    """What one camera far away along seen_from sees; skin closer than grazing to edge-on is lost too."""
    towards = np.asarray(seen_from, float) / np.linalg.norm(seen_from)
    seen = Surface(scan.surface.vertices, scan.surface.triangles).normals @ towards > grazing
    return kept(scan, seen | (scan.label != BODY))


def only_belly(scan: BodyScan) -> BodyScan:
    """The chest is missing: nothing above 17/20 of the way from notch to navel is left."""
    limit = 0.85 * scan.landmarks["navel"][1]
    return kept(scan, scan.surface.vertices[:, 1] < limit)


def add_bed(
    scan: BodyScan, tilt_deg: float = 0.0, margin_mm: float = 250.0, under: bool = False, sag_mm: float = 8.0
) -> BodyScan:
    """A flat bed that the back sinks sag_mm into; unseen under the body unless `under`.

    tilt_deg turns the bed about the body's long axis. margin_mm: how far it shows around the body.
    """
    skin = scan.surface.vertices[scan.label == BODY]
    low, high = skin.min(0) - margin_mm, skin.max(0) + margin_mm
    pitch = max(3.0, float(np.ptp(skin[:, 1])) / 150)
    bed = _grid(np.arange(low[0], high[0], pitch), np.arange(low[1], high[1], pitch), 0.0)
    covered = cKDTree(skin[:, :2]).query(bed.vertices[:, :2])[0] < 1.5 * pitch + 3
    bed = bed if under else bed.kept(~covered)
    tilted = bed.vertices @ Rotation.from_euler("y", tilt_deg, degrees=True).as_matrix().T
    back = np.array([0.0, 0.0, 150.0 / 367.0 * scan.landmarks["navel"][1] + sag_mm])
    return _with(scan, Surface(tilted + back, bed.triangles), BED)


def add_floor_clutter(scan: BodyScan) -> BodyScan:
    """A ball beside the body and a patch of floor 450 mm below, neither touching it."""
    skin = scan.surface.vertices[scan.label == BODY]
    size = float(np.ptp(skin[:, 1])) / 590
    polar, round_ = np.linspace(0.05, np.pi - 0.05, 40)[:, None], np.linspace(0, 2 * np.pi, 60, endpoint=False)
    parts = np.broadcast_arrays(np.sin(polar) * np.cos(round_), np.sin(polar) * np.sin(round_), np.cos(polar))
    ball = np.stack(parts, 2).reshape(-1, 3) * 45 * size + skin.max(0) + np.array([130.0, -60.0, 0]) * size
    floor = _grid(np.arange(-300, 300, 6.0), np.arange(-700, 200, 6.0), float(skin[:, 2].min()) - 450.0)
    with_ball = _with(scan, Surface(ball, _tube_triangles(40, 60)), CLUTTER)
    return _with(with_ball, floor, CLUTTER)


def noise(scan: BodyScan, sigma_mm: float = 1.5, seed: int = 1) -> BodyScan:
    """Every vertex off by a normal error in each direction."""
    error = np.random.default_rng(seed).normal(0, sigma_mm, scan.surface.vertices.shape)
    return replace(scan, surface=Surface(scan.surface.vertices + error, scan.surface.triangles))


def thinned(scan: BodyScan, share: float, seed: int = 1) -> BodyScan:
    """A random share of the vertices, 0 to 1."""
    return kept(scan, np.random.default_rng(seed).random(len(scan.label)) < share)


def mirror(scan: BodyScan) -> BodyScan:
    """Left and right exchanged as in a selfie; every landmark stays on the skin it was clicked on."""
    flip = np.array([-1.0, 1.0, 1.0])
    return replace(
        scan,
        surface=Surface(scan.surface.vertices * flip, scan.surface.triangles[:, ::-1]),
        landmarks={name: place * flip for name, place in scan.landmarks.items()},
        areas={name: place * flip for name, place in scan.areas.items()},
    )


def moved(scan: BodyScan, motion: Similarity) -> BodyScan:
    """The whole scan with its truth, carried along."""
    return replace(
        scan,
        surface=Surface(motion.apply(scan.surface.vertices), scan.surface.triangles),
        landmarks={name: motion.apply(place) for name, place in scan.landmarks.items()},
        areas={name: motion.apply(place) for name, place in scan.areas.items()},
        file_from_body=motion.after(scan.file_from_body),
    )


def turn(
    scan: BodyScan,
    degrees: tuple[float, float, float] = (0, 0, 0),
    shift: tuple[float, float, float] = (0, 0, 0),
) -> BodyScan:
    """Turned about x, y, z in that order, then shifted."""
    rotation = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    return moved(scan, Similarity(1.0, rotation, np.asarray(shift, float)))


def rescale(scan: BodyScan, unit: str) -> BodyScan:
    """From millimetres to m, cm or mm."""
    return moved(scan, Similarity(1.0 / MM_PER_UNIT[unit], np.eye(3), np.zeros(3)))


def inside_out(scan: BodyScan, share: float = 1.0, seed: int = 1) -> BodyScan:
    """A share of the triangles wound the wrong way."""
    triangles = scan.surface.triangles.copy()
    wrong = np.random.default_rng(seed).random(len(triangles)) < share
    triangles[wrong] = triangles[wrong][:, ::-1]
    return replace(scan, surface=Surface(scan.surface.vertices, triangles))


def shuffled(scan: BodyScan, seed: int = 1) -> BodyScan:
    """The same scan with its vertices and triangles in another order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(scan.label))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    triangles = rng.permutation(place[scan.surface.triangles]) if len(scan.surface.triangles) else np.zeros((0, 3))
    return replace(scan, surface=Surface(scan.surface.vertices[order], triangles), label=scan.label[order])


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
