"""Five kinds of scanners, each with its own errors and its own way of writing a file.

Where a number is not a maker's, it follows published tests of such devices on bodies and faces. All of them stand in
one table beside the cohort that uses them, `tests/benchmark/cohort.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface, cloud, unit
from references.make.scan import (
    DepthNoise,
    PhoneSettings,
    Stage,
    camera_towards,
    depth_image,
    joined,
    simulate_depth_frame,
    simulate_phone_mesh,
    simulate_scanner_mesh,
    smooth_skin,
)


@dataclass(frozen=True)
class Scene:
    """What stands before a camera, mm: z up from the bed, +y towards the head.

    people: skin and whatever lies on it; bed: what a careful operator would cut away. centre: (3,) the middle of
    the chest on the mattress; length: from notch to navel.
    """

    people: Surface
    bed: Surface
    centre: np.ndarray
    length: float

    @property
    def all(self) -> Surface:
        """Everything that reflects light."""
        return joined([self.people, self.bed])


@dataclass(frozen=True)
class Shot:
    """A scan in the file's coordinates. file_from_scene: the true map, a wrong scale of the device included."""

    surface: Surface
    file_from_scene: Similarity
    file_type: str

    def encoded(self) -> bytes:
        """The file."""
        if self.surface.is_cloud:
            return bytes(trimesh.PointCloud(self.surface.vertices).export(file_type=self.file_type))
        vertices = self.surface.vertices.astype(np.float32)
        return bytes(trimesh.Trimesh(vertices, self.surface.triangles, process=False).export(file_type=self.file_type))


Scanner = Callable[[Scene, np.random.Generator], Shot]

KINECT_SIGMA_MM = (2.0, 5.0)
LIDAR_SCALE, TRUEDEPTH_SCALE = 0.010, 0.004
"""One standard deviation of a handheld scan's size: circumferences of bodies by phone LiDAR are 1-7 % off."""


def overhead_frame(scene: Scene, random: np.random.Generator) -> Shot:
    """The paper's camera (L515) over the bed: one frame, 2.5 mm at 0.7 m, metres, camera axes."""
    return _one_frame(scene, random, (350.0 + 1.4 * scene.length) * random.uniform(0.8, 1.0), DepthNoise(), 0.001)


def kinect_frame(scene: Scene, random: np.random.Generator) -> Shot:
    """A Kinect from farther away: one coarse frame, 2-5 mm at 1 m, mostly correlated, flying pixels, millimetres."""
    noise = DepthNoise(
        sigma_mm=random.uniform(*KINECT_SIGMA_MM), at_mm=1000.0, correlated_share=0.7, dropout=0.05, flying_share=0.3
    )
    lens = {"columns": 300, "rows": 225}
    return _one_frame(scene, random, (500.0 + 1.8 * scene.length) * random.uniform(0.9, 1.1), noise, 1.0, **lens)


def _one_frame(
    scene: Scene, random: np.random.Generator, height: float, noise: DepthNoise, per_mm: float, **lens: float
) -> Shot:
    middle = scene.centre + [0.0, 0.0, 100.0]
    above = np.array([*random.uniform(-60.0, 60.0, 2), height])
    turn = random.uniform(-0.3, 0.3)
    camera = camera_towards(middle + above, middle, np.array([np.sin(turn), np.cos(turn), 0.0]), **lens)
    surface, file_from_scene = simulate_depth_frame(scene.all, camera, random, noise)
    bigger = Similarity(1000.0 * per_mm, np.eye(3), np.zeros(3))
    return Shot(cloud(bigger.apply(surface.vertices)), bigger.after(file_from_scene), "ply")


def phone_lidar(scene: Scene, random: np.random.Generator) -> Shot:
    """A phone's LiDAR walked around the bed: a fused, smooth mesh with the bed in it, metres, +Y up."""
    settings = replace(
        PhoneSettings(),
        cube_mm=110.0 + 2.2 * scene.length,
        voxel_mm=random.uniform(7.0, 10.0),
        turns_deg=(-70.0, -35.0, 0.0, 35.0, 70.0),
        heights_mm=(-0.35 * scene.length, 0.35 * scene.length),
        columns=200,
        rows=150,
    )
    mesh = simulate_phone_mesh(Stage(scene.all), scene.centre + [0.0, 0.0, 100.0], random, settings)
    across, along = 0.85 * scene.length, 0.95 * scene.length
    offset = np.abs(mesh.vertices - scene.centre)
    boxed = mesh.kept((offset[:, 0] < across) & (offset[:, 1] < along))
    return _as_phone_file(boxed, random, LIDAR_SCALE, "glb")


TRUEDEPTH_NOISE = DepthNoise(sigma_mm=1.0, at_mm=400.0, dropout=0.01, holes=(0, 2))


@dataclass(frozen=True)
class TrueDepthSettings:
    """A telephone's face camera, held close and moved over the chest; frames laid on each other and thinned."""

    noise: DepthNoise = TRUEDEPTH_NOISE
    shift_mm: float = 0.7
    turn_deg: float = 0.15
    """Error of each frame's place, one standard deviation."""
    turns_deg: tuple[float, ...] = (-35.0, 0.0, 35.0)
    along: tuple[float, ...] = (-0.5, 0.0, 0.5)
    grid_mm: float = 4.0
    farthest_mm: float = 800.0


def truedepth_frames(scene: Scene, random: np.random.Generator, settings: TrueDepthSettings | None = None) -> Shot:
    """Nine frames from a forearm's length, about 1 mm each, fused to a cloud; metres, +Y up."""
    settings = settings or TrueDepthSettings()
    stage, middle = Stage(scene.all), scene.centre + [0.0, 0.0, 100.0]
    points = []
    for turn in np.deg2rad(settings.turns_deg):
        for along in settings.along:
            target = middle + [0.0, along * scene.length, 0.0]
            away = (300.0 + 0.4 * scene.length) * np.array([np.sin(turn), 0.0, np.cos(turn)])
            camera = camera_towards(target + away, target, np.array([0.0, 1.0, 0.0]), columns=160, rows=120)
            distance, rays = depth_image(stage, camera, random, settings.noise)
            seen = distance < settings.farthest_mm
            error = Rotation.from_rotvec(np.deg2rad(settings.turn_deg) * random.normal(size=3)).as_matrix()
            frame = (rays[seen] * distance[seen][:, None]) @ error.T
            points.append(camera.position + frame + settings.shift_mm * random.normal(size=3))
    return _as_phone_file(cloud(_thinned(np.concatenate(points), settings.grid_mm)), random, TRUEDEPTH_SCALE, "ply")


def _thinned(points: np.ndarray, grid: float) -> np.ndarray:
    """(m, 3) the mean of the points in each cell of a grid."""
    cells, which = np.unique(np.floor(points / grid).astype(np.int64), axis=0, return_inverse=True)
    count = np.bincount(which.ravel(), minlength=len(cells))
    return np.column_stack([np.bincount(which.ravel(), points[:, axis], len(cells)) / count for axis in range(3)])


def _as_phone_file(surface: Surface, random: np.random.Generator, scale_sigma: float, file_type: str) -> Shot:
    turn = random.uniform(-np.pi, np.pi)
    right, head = np.array([np.cos(turn), 0.0, -np.sin(turn)]), np.array([-np.sin(turn), 0.0, -np.cos(turn)])
    rotation = np.stack([right, head, np.array([0.0, 1.0, 0.0])], axis=1)
    scale = 0.001 * (1 + scale_sigma * random.normal())
    file_from_scene = Similarity(float(scale), rotation, random.uniform(-0.8, 0.8, 3))
    return Shot(Surface(file_from_scene.apply(surface.vertices), surface.triangles), file_from_scene, file_type)


def structured_light(scene: Scene, random: np.random.Generator) -> Shot:
    """A handheld structured-light scanner: a mesh of what it saw, 0.5 mm, bed cut away, millimetres, any axes."""
    offset = scene.people.vertices - scene.centre
    inside = (np.abs(offset[:, 0]) < 0.85 * scene.length) & (np.abs(offset[:, 1]) < 0.95 * scene.length)
    near = scene.people.kept(inside)
    seen = near.kept(_seen(Stage(scene.all), near.vertices, scene))
    mesh = simulate_scanner_mesh(smooth_skin(_without_loose_points(seen)), random, wobble_mm=0.5)
    rotation = Rotation.random(random_state=random).as_matrix()
    file_from_scene = Similarity(1.0, rotation, random.uniform(-500.0, 500.0, 3))
    return Shot(Surface(file_from_scene.apply(mesh.vertices), mesh.triangles), file_from_scene, "stl")


def _without_loose_points(surface: Surface) -> Surface:
    """Without vertices that no triangle uses: subdivision makes them infinite."""
    used = np.zeros(len(surface.vertices), bool)
    used[surface.triangles] = True
    return surface.kept(used)


def _seen(stage: Stage, points: np.ndarray, scene: Scene, hidden_mm: float = 2.0) -> np.ndarray:
    """(n,) whether one of the places where the scanner is held has a free view of a point."""
    found = np.zeros(len(points), bool)
    for turn in np.deg2rad([-75.0, -40.0, 0.0, 40.0, 75.0]):
        for along in (-0.6, 0.2):
            place = (
                scene.centre + [0.0, along * scene.length, 100.0] + 500.0 * np.array([np.sin(turn), 0, np.cos(turn)])
            )
            gap = points - place
            met, _ = stage.cast(place, unit(gap))
            found |= met > np.linalg.norm(gap, axis=1) - hidden_mm
    return found


SCANNERS: Mapping[str, Scanner] = {
    "overhead depth frame": overhead_frame,
    "phone LiDAR mesh": phone_lidar,
    "TrueDepth, fused": truedepth_frames,
    "structured light": structured_light,
    "Kinect": kinect_frame,
}
