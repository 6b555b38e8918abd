"""Made-up torsos with exactly known landmarks, and the things that go wrong when somebody scans one.

A test builds a body, damages it step by step and writes it to bytes:

    scan = add_bed(hide_side(torso_scan(size=0.6)))
    data = write_ply(rescale(turn(scan, degrees=(5, 20, 0)), "m").surface)

Everything is in millimetres in the body frame until `rescale` and `turn`, which therefore come last.
Nothing here is random without a seed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import MM_PER_UNIT, Similarity
from lubdub.geometry.surface import Surface, cloud
from lubdub.results import AreaName, LandmarkName
from tests.torso import ADULT_STERNUM_MM as ADULT_STERNUM_MM
from tests.torso import Shape as Shape
from tests.torso import areas_of as areas_of
from tests.torso import landmarks_of as landmarks_of
from tests.torso import torso_surface as torso_surface
from tests.torso import tube_triangles
from tests.writers import pack_glb as pack_glb
from tests.writers import write_glb as write_glb
from tests.writers import write_obj as write_obj
from tests.writers import write_pcd as write_pcd
from tests.writers import write_ply as write_ply
from tests.writers import write_stl as write_stl
from tests.writers import write_textured_glb as write_textured_glb
from tests.writers import write_xyz as write_xyz

BODY, BED, CLUTTER = 0, 1, 2


@dataclass(frozen=True)
class BodyScan:
    """A scan whose truth is known. label: (n,) BODY, BED or CLUTTER for each vertex of surface."""

    surface: Surface
    label: np.ndarray
    landmarks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    file_from_body: Similarity = field(default_factory=Similarity.identity)


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
    return Surface(vertices, tube_triangles(rows, columns))


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
    with_ball = _with(scan, Surface(ball, tube_triangles(40, 60)), CLUTTER)
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
