"""Simulated cameras: what a depth camera, a phone and a scanner would make of a lying person.

Everything random comes from the generator handed in. Lengths in mm, body frame, until a scan leaves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from lubdub.geometry.frames import Similarity
from lubdub.geometry.one_thread import one_threaded_open3d
from lubdub.geometry.surface import Surface, cloud, unit


@dataclass(frozen=True)
class Camera:
    """A pinhole depth camera. position: (3,); axes: (3, 3) rows right, down, forward; tangents of half angles."""

    position: np.ndarray
    axes: np.ndarray
    columns: int = 360
    rows: int = 270
    half_width: float = 0.62
    half_height: float = 0.47

    def rays(self) -> np.ndarray:
        """(rows, columns, 3) unit directions."""
        across = self.half_width * (2 * (np.arange(self.columns) + 0.5) / self.columns - 1)
        down = self.half_height * (2 * (np.arange(self.rows) + 0.5) / self.rows - 1)
        x, y = np.meshgrid(across, down)
        return unit(np.stack([x, y, np.ones_like(x)], axis=-1)) @ self.axes


@dataclass(frozen=True)
class DepthNoise:
    """Errors of one depth frame; sigma grows with the square of the distance, as the paper's camera's does."""

    sigma_mm: float = 2.5
    at_mm: float = 700.0
    correlated_share: float = 0.53
    """Of sigma, over two pixels; the rest (0.85) is white."""
    dropout: float = 0.03
    holes: tuple[int, int] = (4, 9)
    grazing_cosine: float = 0.2
    flying_share: float = 0.0
    """Of the pixels at a step in depth, how many hang in the air between near and far."""


def camera_towards(position: np.ndarray, target: np.ndarray, up: np.ndarray, **lens: float) -> Camera:
    """A camera at position (3,) that looks at target (3,), the picture's top roughly towards up (3,)."""
    forward = unit(target - position)
    right = unit(np.cross(forward, up))
    return Camera(position, np.stack([right, np.cross(forward, right), forward]), **lens)  # type: ignore[arg-type]


def joined(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    starts = np.cumsum([0] + [len(surface.vertices) for surface in surfaces[:-1]])
    triangles = [surface.triangles + start for surface, start in zip(surfaces, starts, strict=True)]
    return Surface(np.concatenate([surface.vertices for surface in surfaces]), np.concatenate(triangles))


def smooth_skin(surface: Surface) -> Surface:
    """One step of Loop subdivision: real skin has no facets. A frayed rim, of which Open3D warns, does no harm."""
    open3d = one_threaded_open3d()

    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(surface.vertices), open3d.utility.Vector3iVector(surface.triangles)
    )
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        mesh = mesh.subdivide_loop(1)
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.triangles))


class Stage:
    """A scene ready to be looked at from many places."""

    def __init__(self, scene: Surface) -> None:
        open3d = one_threaded_open3d()

        self._caster = open3d.t.geometry.RaycastingScene(nthreads=1)
        self._caster.add_triangles(scene.vertices.astype(np.float32), scene.triangles.astype(np.uint32))

    def cast(self, origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(...,) distances to what rays (..., 3) from origin (3,) meet, inf for nothing; and (..., 3) its normals."""
        starts = np.broadcast_to(origin, rays.shape)
        hit = self._caster.cast_rays(np.concatenate([starts, rays], axis=-1).astype(np.float32))
        return hit["t_hit"].numpy().astype(np.float64), hit["primitive_normals"].numpy()

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) the places of the scene that are nearest to points (k, 3)."""
        return self._caster.compute_closest_points(points.astype(np.float32))["points"].numpy().astype(np.float64)


def depth_image(
    scene: Surface | Stage, camera: Camera, random: np.random.Generator, noise: DepthNoise
) -> tuple[np.ndarray, np.ndarray]:
    """(rows, columns) distances along the rays, NaN where nothing is seen, and (rows, columns, 3) the rays."""
    stage = scene if isinstance(scene, Stage) else Stage(scene)
    rays = camera.rays()
    distance, normals = stage.cast(camera.position, rays)
    facing = np.abs((normals * rays).sum(-1))
    seen = np.isfinite(distance) & (facing > noise.grazing_cosine) & _no_holes(distance.shape, random, noise)
    distance[~np.isfinite(distance)] = 0.0
    blur = gaussian_filter(random.normal(size=distance.shape), 2.0)
    grain = np.sqrt(1 - noise.correlated_share**2) * random.normal(size=distance.shape)
    grain += noise.correlated_share * blur / blur.std()
    noisy = distance + grain * noise.sigma_mm * (distance / noise.at_mm) ** 2
    if noise.flying_share > 0:
        noisy = _with_flying_pixels(noisy, random, noise)
    return np.where(seen, noisy, np.nan), rays


STEP_MM = 30.0
"""A difference in depth between neighbouring pixels that is an edge of something, not its slope."""


def _with_flying_pixels(distance: np.ndarray, random: np.random.Generator, noise: DepthNoise) -> np.ndarray:
    """Time of flight mixes what lies in front of and behind an edge within one pixel."""
    near, far = minimum_filter(distance, 3), maximum_filter(distance, 3)
    flies = (near > 0) & (far - near > STEP_MM) & (random.random(distance.shape) < noise.flying_share)
    return np.where(flies, near + random.random(distance.shape) * (far - near), distance)


def _no_holes(shape: tuple[int, ...], random: np.random.Generator, noise: DepthNoise) -> np.ndarray:
    kept = random.random(shape) > noise.dropout
    row, column = np.ogrid[: shape[0], : shape[1]]
    for _ in range(random.integers(*noise.holes)):
        centre = random.uniform(0, shape[0]), random.uniform(0, shape[1])
        radius, stretch = random.uniform(3, 9), random.uniform(0.6, 1.6)
        kept &= (row - centre[0]) ** 2 + ((column - centre[1]) * stretch) ** 2 > radius**2
    return kept


def simulate_depth_frame(
    scene: Surface | Stage, camera: Camera, random: np.random.Generator, noise: DepthNoise | None = None
) -> tuple[Surface, Similarity]:
    """One depth frame as a cloud in metres in the camera's axes (x right, y down, z forward), and body -> file."""
    distance, rays = depth_image(scene, camera, random, noise or DepthNoise())
    seen = np.isfinite(distance)
    points = camera.position + rays[seen] * distance[seen][:, None]
    file_from_body = Similarity(0.001, camera.axes, -0.001 * camera.axes @ camera.position)
    return cloud(file_from_body.apply(points)), file_from_body


@dataclass(frozen=True)
class PhoneSettings:
    """A phone with a depth sensor walked around a lying person, its frames fused as such programs do."""

    cube_mm: float = 900.0
    voxel_mm: float = 9.0
    truncation_mm: float = 36.0
    frame_noise: DepthNoise = DepthNoise(sigma_mm=5.0, dropout=0.01, holes=(0, 2))
    drift_mm: float = 3.0
    """Random error of each frame's place."""
    turns_deg: tuple[float, ...] = (-75.0, -50.0, -25.0, 0.0, 25.0, 50.0, 75.0)
    heights_mm: tuple[float, ...] = (-120.0, 120.0)
    distance_mm: float = 620.0
    columns: int = 360
    rows: int = 270


def simulate_phone_mesh(
    scene: Surface | Stage, centre: np.ndarray, random: np.random.Generator, settings: PhoneSettings | None = None
) -> Surface:
    """The fused mesh, mm, body frame. centre: (3,) what the phone is pointed at."""
    open3d = one_threaded_open3d()

    settings = settings or PhoneSettings()
    stage = scene if isinstance(scene, Stage) else Stage(scene)
    volume = open3d.pipelines.integration.UniformTSDFVolume(
        length=settings.cube_mm,
        resolution=round(settings.cube_mm / settings.voxel_mm),
        sdf_trunc=settings.truncation_mm,
        origin=centre - settings.cube_mm / 2,
        color_type=open3d.pipelines.integration.TSDFVolumeColorType.NoColor,
    )
    for turn in np.deg2rad(settings.turns_deg):
        for along in settings.heights_mm:
            away = settings.distance_mm * np.array([np.sin(turn), 0.0, np.cos(turn)])
            place = centre + away + [0.0, along, 0.0]
            lens = {"columns": settings.columns, "rows": settings.rows}
            camera = camera_towards(place, centre + [0.0, 0.3 * along, 0.0], np.array([0.0, 1.0, 0.0]), **lens)
            _integrate(volume, stage, camera, random, settings)
    mesh = volume.extract_triangle_mesh()
    return in_fixed_order(Surface(np.asarray(mesh.vertices), np.asarray(mesh.triangles)))


def _integrate(
    volume: object, scene: Stage, camera: Camera, random: np.random.Generator, settings: PhoneSettings
) -> None:
    open3d = one_threaded_open3d()

    distance, rays = depth_image(scene, camera, random, settings.frame_noise)
    depth = np.nan_to_num(distance * (rays @ camera.axes[2])).astype(np.float32)
    blank = open3d.geometry.Image(np.zeros((*depth.shape, 3), np.uint8))
    picture = open3d.geometry.RGBDImage.create_from_color_and_depth(
        blank, open3d.geometry.Image(depth), depth_scale=1.0, depth_trunc=1500.0, convert_rgb_to_intensity=False
    )
    focal_x, focal_y = camera.columns / (2 * camera.half_width), camera.rows / (2 * camera.half_height)
    lens = open3d.camera.PinholeCameraIntrinsic(
        camera.columns, camera.rows, focal_x, focal_y, camera.columns / 2 - 0.5, camera.rows / 2 - 0.5
    )
    camera_from_body = np.eye(4)
    camera_from_body[:3, :3] = camera.axes
    shaken = camera.position + random.normal(size=3) * settings.drift_mm
    camera_from_body[:3, 3] = -camera.axes @ shaken
    volume.integrate(picture, lens, camera_from_body)  # type: ignore[attr-defined]


def in_fixed_order(surface: Surface) -> Surface:
    """The same surface with vertices and triangles sorted: hash maps hand them out in any order."""
    vertices = np.round(surface.vertices, 3)
    order = np.lexsort(vertices.T[::-1])
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    triangles = place[surface.triangles]
    start = triangles.argmin(axis=1)
    triangles = np.stack([triangles[np.arange(len(start)), (start + turn) % 3] for turn in range(3)], axis=1)
    return Surface(vertices[order], triangles[np.lexsort(triangles.T[::-1])])


def simulate_scanner_mesh(skin: Surface, random: np.random.Generator, wobble_mm: float = 0.8) -> Surface:
    """A good scanner's mesh: the skin with a small, locally smooth error along the normals. mm, body frame."""
    from scipy.spatial import cKDTree

    grain = random.normal(size=len(skin.vertices))
    near = cKDTree(skin.vertices).query(skin.vertices, k=12)[1]
    smooth = grain[near].mean(axis=1)
    smooth *= wobble_mm / smooth.std()
    return Surface(skin.vertices + smooth[:, None] * skin.normals, skin.triangles)
