"""Made-up torsos with skin colour and printed stickers on them, as a texture or at every point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lubdub.geometry.colour import Colouring
from lubdub.geometry.stickers import STICKERS, Bone, StickerSize
from lubdub.geometry.surface import Surface, cloud, triangle_normals, unit
from lubdub.results import CleanScan, RawScan
from lubdub.scans.clean import clean
from lubdub.scans.units import find_unit
from references.make.paint import Complexion, Stuck, draw_complexion
from tests import bodies
from tests.bodies import BodyScan
from tests.torso import Shape

BONES: tuple[Bone, ...] = ("suprasternal_notch", "xiphisternum")


@dataclass(frozen=True)
class PaintedScan:
    """A scan with its truth, and its colours; the triangles of both are in the same order."""

    scan: BodyScan
    colouring: Colouring
    stuck: tuple[Stuck, ...]

    @property
    def raw(self) -> RawScan:
        """As a reader hands it over."""
        return RawScan(self.scan.surface, "glb", colouring=self.colouring)

    def cleaned(self) -> CleanScan:
        """The chest alone, in mm."""
        return clean(self.raw, find_unit(self.raw, None, {}), {})

    def mirrored(self, wound_again: bool = False) -> PaintedScan:
        """As with a mirror; wound_again: by a program that keeps the outside out."""
        order = [2, 1, 0] if wound_again else [0, 1, 2]
        other = bodies.mirror(self.scan)
        surface = Surface(other.surface.vertices, other.surface.triangles[:, ::-1][:, order])
        corners = None if self.colouring.corners is None else self.colouring.corners[:, order]
        return replace(self, scan=replace(other, surface=surface), colouring=replace(self.colouring, corners=corners))


def stuck_on(
    size: float, bones: tuple[Bone, ...] = BONES, kind: StickerSize = "large", turn: float = 0.4
) -> tuple[Stuck, ...]:
    """Stickers on the bones of a torso of this size."""
    shape = Shape(size, 0.15, 0.2, 1.0)
    places = bodies.torso_scan(size=size, columns=20, rows=20).landmarks
    step = 8.0 * size
    stuck = []
    for sticker in (one for one in STICKERS if one.size == kind and one.bone in bones):
        x, y, z = places[sticker.bone]
        slope = [
            float(shape.front(np.array(x + step * a), np.array(y + step * b)) - z) / step for a, b in ((1, 0), (0, 1))
        ]
        stuck.append(Stuck(sticker, places[sticker.bone], unit(np.array([-slope[0], -slope[1], 1.0])), 0.4))
    return tuple(stuck)


def complexion(size: float, stuck: tuple[Stuck, ...], seed: int = 1) -> Complexion:
    """Skin of some colour."""
    torso = bodies.torso_scan(size=size, columns=60, rows=60)
    nipples = np.array([torso.landmarks["nipple_left"], torso.landmarks["nipple_right"]])
    return draw_complexion(np.random.default_rng(seed), torso.surface, nipples, size, stuck)


def painted(
    size: float = 1.0,
    stuck: tuple[Stuck, ...] | None = None,
    seed: int = 1,
    pixel_mm: float = 1.2,
    noise_mm: float = 0.7,
) -> PaintedScan:
    """The front of a torso with a photograph laid over it from in front. stuck: both stickers when not given."""
    pixel_mm, stuck = 1.2, stuck_on(size) if stuck is None else stuck
    true = bodies.hide_side(bodies.torso_scan(size=size))
    skin, shape = complexion(size, stuck, seed), Shape(size, 0.15, 0.2, 1.0)
    low, high = true.surface.vertices[:, :2].min(axis=0), true.surface.vertices[:, :2].max(axis=0)
    columns, rows = (int(np.ceil((high[one] - low[one]) / pixel_mm)) for one in (0, 1))
    x, y = np.meshgrid(low[0] + (np.arange(columns) + 0.5) * pixel_mm, high[1] - (np.arange(rows) + 0.5) * pixel_mm)
    points = np.stack([x, y, np.nan_to_num(shape.front(x, y))], axis=-1).reshape(-1, 3)
    picture = (skin.colours(points) * 255).astype(np.uint8).reshape(rows, columns, 3)
    places = (true.surface.vertices[:, :2] - low) / (np.array([columns, rows]) * pixel_mm)
    places[:, 1] = (high[1] - true.surface.vertices[:, 1]) / (rows * pixel_mm)
    triangles = true.surface.triangles
    faces = triangle_normals(true.surface.vertices, triangles)[:, 2] > 0
    colouring = Colouring(
        None, (picture,), places[triangles].astype(np.float32), np.where(faces, 0, -1).astype(np.int8)
    )
    return PaintedScan(bodies.noise(true, noise_mm, seed), colouring, stuck)


def painted_points(size: float = 1.0, stuck: tuple[Stuck, ...] | None = None, step_mm: float = 1.5) -> PaintedScan:
    """The same as a cloud of coloured points."""
    stuck = stuck_on(size) if stuck is None else stuck
    shape, torso = Shape(size, 0.15, 0.2, 1.0), bodies.torso_scan(size=size)
    low, high = torso.surface.vertices[:, :2].min(axis=0) * 0.85, torso.surface.vertices[:, :2].max(axis=0) * 0.85
    x, y = np.meshgrid(np.arange(low[0], high[0], step_mm), np.arange(low[1], high[1], step_mm))
    inside = np.abs(x) < 0.9 * shape.half_breadth(y)
    points = np.stack([x[inside], y[inside], shape.front(x[inside], y[inside])], axis=1)
    points += np.random.default_rng(5).normal(size=points.shape) * 0.5
    colours = (complexion(size, stuck).colours(points) * 255).astype(np.uint8)
    scan = replace(torso, surface=cloud(points), label=np.zeros(len(points), int))
    return PaintedScan(scan, Colouring(colours), stuck)
