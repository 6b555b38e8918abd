"""Colour for simulated scans: skin, printed stickers on it, and the photographs that an app lays over its mesh.

An app photographs the true skin and lays the pictures over a mesh that is a few millimetres off, so each picture is a
little shifted, blurred and packed. That is repeated here. Lengths in mm, body frame; colours 0 to 1 until a photograph.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from lubdub.geometry.colour import Colouring, sampled
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.stickers import MARK_CELLS, Sticker
from lubdub.geometry.surface import Surface, unit
from references.make.scan import Camera

PAPER, INK = 0.9, 0.07
_HAIR_PER_BLOTCH = 15.0
_HAIRY_SIZE = 0.9  # of an adult
_UNSEEN = -2.0
CLEAR_OF_SKIN_MM = 25.0
"""A sticker colours only what lies within this depth of its middle: not the back of the same body."""


@dataclass(frozen=True)
class Stuck:
    """A sticker on a body. position: (3,) its middle; normal: (3,) unit, out of the skin; turn: radians about it."""

    sticker: Sticker
    position: np.ndarray
    normal: np.ndarray
    turn: float = 0.0

    def over(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k,) which points (k, 3) it covers, and the brightness (k,) of its print there."""
        right = unit(np.cross([0.3, 1.0, 0.2], self.normal))
        up = np.cross(self.normal, right)
        offset = points - self.position
        x, y = offset @ right, offset @ up
        x, y = np.cos(self.turn) * x - np.sin(self.turn) * y, np.sin(self.turn) * x + np.cos(self.turn) * y
        covered = (np.hypot(x, y) < self.sticker.diameter_mm / 2) & (np.abs(offset @ self.normal) < CLEAR_OF_SKIN_MM)
        column = np.floor(x / self.sticker.cell_mm + MARK_CELLS / 2).astype(int)
        row = np.floor(MARK_CELLS / 2 - y / self.sticker.cell_mm).astype(int)
        inside = (np.minimum(row, column) >= 0) & (np.maximum(row, column) < MARK_CELLS)
        cells = self.sticker.cells()[np.clip(row, 0, MARK_CELLS - 1), np.clip(column, 0, MARK_CELLS - 1)]
        return covered, np.where(inside & cells, INK, PAPER)


@dataclass(frozen=True)
class Patch:
    """Skin of a colour of its own around a middle (3,). radius: mm; tone: (3,); rim: share of the radius over which it
    fades; ripples: (4, 3) waves of its outline, zero for a circle."""

    middle: np.ndarray
    radius: float
    tone: np.ndarray
    rim: float
    ripples: np.ndarray

    def over(self, points: np.ndarray) -> np.ndarray:
        """(k,) how much of each point's colour is the patch's."""
        offset = points - self.middle
        outline = 1 + 0.12 * np.sin(2.0 * offset / self.radius @ self.ripples.T).mean(axis=1)
        return np.asarray(np.clip((outline - np.linalg.norm(offset, axis=1) / self.radius) / self.rim + 0.5, 0, 1))


@dataclass(frozen=True)
class Shadow:
    """Less light on one side of an edge. place: (3,) on the edge; across: (3,) into the shadow; takes: share of the
    light; soft_mm: half the width of the edge."""

    place: np.ndarray
    across: np.ndarray
    takes: float
    soft_mm: float

    def light(self, points: np.ndarray) -> np.ndarray:
        """(k,) the share of the light that reaches points (k, 3)."""
        depth = np.clip((points - self.place) @ self.across / self.soft_mm, -1, 1)
        return np.asarray(1 - self.takes * (0.5 + 0.5 * depth))


@dataclass(frozen=True)
class Complexion:
    """One person's skin. spots: (k, 4) place and radius of each mole, nipple, scar; their colour is spot_tone.

    hair: how dark the hair of the chest is, 0 for none. flush: (w, 5) waves of the skin's redness and their height.
    """

    tone: np.ndarray
    waves: np.ndarray
    spots: np.ndarray
    spot_tones: np.ndarray
    hair: float = 0.0
    stuck: tuple[Stuck, ...] = ()
    patches: tuple[Patch, ...] = ()
    flush: np.ndarray = field(default_factory=lambda: np.zeros((0, 5)))
    shadow: Shadow | None = None

    def colours(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) colour of the skin at points (k, 3), stickers and all, before any light."""
        phase = points @ self.waves[:, :3].T + self.waves[:, 3]
        colours = self.tone * (1 + 0.06 * np.sin(phase).mean(axis=1) * np.sqrt(len(self.waves)))[:, None]
        strands = np.sin(points @ (_HAIR_PER_BLOTCH * self.waves[:8, :3]).T + self.waves[:8, 3]).mean(axis=1)
        colours *= 1 - self.hair * np.clip(3.0 * strands, 0, 1)[:, None]
        for (*middle, radius), tone in zip(self.spots, self.spot_tones, strict=True):
            here = _around(points, np.array(middle), 1.5 * radius)
            near = np.clip(1.5 - np.linalg.norm(points[here] - middle, axis=1) / radius, 0, 1)[:, None]
            colours[here] = (1 - near) * colours[here] + near * tone
        for patch in self.patches:
            here = _around(points, patch.middle, 1.5 * patch.radius)
            share = patch.over(points[here])[:, None]
            colours[here] = (1 - share) * colours[here] + share * patch.tone
        if len(self.flush):
            redness = (np.sin(points @ self.flush[:, :3].T + self.flush[:, 3]) * self.flush[:, 4]).mean(axis=1)
            colours *= np.exp(np.outer(np.sqrt(len(self.flush)) * redness, [0.5, -0.5, -0.5]))
        if self.shadow is not None:
            colours *= self.shadow.light(points)[:, None]
        for one in self.stuck:
            covered, brightness = one.over(points)
            colours[covered] = brightness[covered, None] * [1.0, 0.99, 0.96]
        return np.clip(colours, 0, 1)


def _around(points: np.ndarray, middle: np.ndarray, reach: float) -> np.ndarray:
    """Which points (k, 3) lie between two planes around a middle (3,): all that are within reach, and few others."""
    return np.flatnonzero(np.abs(points[:, 1] - middle[1]) <= reach)


def draw_complexion(
    random: np.random.Generator, skin: Surface, nipples: np.ndarray, size: float, stuck: tuple[Stuck, ...] = ()
) -> Complexion:
    """A skin from very light to very dark with blotches, moles, hair and nipples (k, 3). size: share of an adult."""
    light = random.uniform(0.18, 0.85)
    tone = np.array([1.0, random.uniform(0.68, 0.8), random.uniform(0.5, 0.66)]) * light
    waves = random.normal(size=(24, 4)) * [0.05, 0.05, 0.05, 0.0] + [0.0, 0.0, 0.0, 1.0] * random.uniform(0, 7, (24, 1))
    moles = skin.vertices[random.integers(len(skin.vertices), size=random.integers(0, 60))]
    spots = np.column_stack([moles, random.uniform(0.8, 3.5, len(moles))])
    spots = np.concatenate([spots, np.column_stack([nipples, np.full(len(nipples), random.uniform(7, 14) * size)])])
    tones = tone * random.uniform(0.25, 0.75, (len(spots), 1))
    hair = max(0.0, float(random.uniform(-0.6, 0.6))) * (size > _HAIRY_SIZE)
    return Complexion(tone, waves, spots, tones, hair, stuck)


@dataclass(frozen=True)
class PhotoSettings:
    """How good the app's pictures are. pixel_mm: on the skin, from distance_mm away."""

    pixel_mm: float = 1.3
    distance_mm: float = 620.0
    blur_pixels: float = 0.7
    noise: float = 0.015
    jpeg: int = 78
    exposures: tuple[float, float] = (0.75, 1.15)
    shift_mm: float = 1.5
    """How far the camera is from where the app believes it."""
    half_mm: float = 330.0
    turns_deg: tuple[float, ...] = (-50.0, 0.0, 50.0)
    tilts_deg: tuple[float, ...] = (-25.0, 20.0)


@dataclass(frozen=True)
class Photo:
    """A picture and the camera the app believes took it."""

    camera: Camera
    picture: np.ndarray = field(repr=False)


def photographs(
    scene: Surface, complexion: Complexion, centre: np.ndarray, random: np.random.Generator, settings: PhotoSettings
) -> list[Photo]:
    """Pictures from all round the front of a body. scene: the true skin; centre: (3,) what they look at."""
    caster, normals = SkinCaster(scene), scene.normals
    light = unit(np.array([random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), 1.0]))
    photos = []
    for turn in np.deg2rad(settings.turns_deg):
        for tilt in np.deg2rad(settings.tilts_deg):
            away = np.array([np.sin(turn) * np.cos(tilt), np.sin(tilt), np.cos(turn) * np.cos(tilt)])
            camera = _camera(centre + settings.distance_mm * away, centre, settings)
            picture = _photograph(scene, normals, caster, complexion, camera, light, random, settings)
            shift = random.normal(size=3) * settings.shift_mm / np.sqrt(3)
            photos.append(Photo(_moved(camera, shift), picture))
    return photos


def _camera(position: np.ndarray, target: np.ndarray, settings: PhotoSettings) -> Camera:
    forward = unit(target - position)
    right = unit(np.cross(forward, [0.0, 1.0, 0.0]))
    half, pixels = settings.half_mm / settings.distance_mm, round(2 * settings.half_mm / settings.pixel_mm)
    axes = np.stack([right, np.cross(forward, right), forward])
    return Camera(position, axes, pixels, pixels, half, half)


def _moved(camera: Camera, shift: np.ndarray) -> Camera:
    return Camera(
        camera.position + shift, camera.axes, camera.columns, camera.rows, camera.half_width, camera.half_height
    )


def _photograph(
    scene: Surface,
    normals: np.ndarray,
    caster: SkinCaster,
    complexion: Complexion,
    camera: Camera,
    light: np.ndarray,
    random: np.random.Generator,
    settings: PhotoSettings,
) -> np.ndarray:
    """(rows, columns, 3) uint8. Four rays for each pixel, or edges would be sharper than a lens makes them."""
    fine = Camera(
        camera.position, camera.axes, 2 * camera.columns, 2 * camera.rows, camera.half_width, camera.half_height
    )
    rays = fine.rays().reshape(-1, 3)
    hits = caster.cast(fine.position, rays)
    picture = np.full((len(rays), 3), 0.35)
    met = hits.met
    facing = np.einsum("kc,kcd->kd", hits.weights[met], normals[scene.triangles[hits.triangle[met]]])
    shade = 0.45 + 0.55 * np.clip(unit(facing) @ light, 0, 1)
    picture[met] = complexion.colours(hits.points[met]) * shade[:, None]
    picture = picture.reshape(camera.rows, 2, camera.columns, 2, 3).mean(axis=(1, 3))
    picture = gaussian_filter(picture, (settings.blur_pixels, settings.blur_pixels, 0)) * random.uniform(
        *settings.exposures
    )
    picture = np.clip(picture, 0, 1) ** (1 / 1.6) + random.normal(size=picture.shape) * settings.noise
    return _packed(np.clip(picture * 255, 0, 255).astype(np.uint8), settings.jpeg)


def _packed(picture: np.ndarray, quality: int) -> np.ndarray:
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "JPEG", quality=quality)
    return np.asarray(Image.open(out))


def laid_over(mesh: Surface, photos: Sequence[Photo], patch_mm: float = 25.0) -> Colouring:
    """The pictures laid over the app's mesh, all of them side by side in one.

    Each patch of skin has the picture that saw it from straightest above. patch_mm: how far apps smooth that choice,
    so that few seams run over a body.
    """
    near = cKDTree(mesh.vertices).query(mesh.vertices, k=40, distance_upper_bound=patch_mm, workers=1)[1]
    padded = np.concatenate([mesh.normals, np.zeros((1, 3))])
    normals = unit(padded[near].mean(axis=1))[mesh.triangles].mean(axis=1)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    best, corners = np.full(len(middles), _UNSEEN), np.zeros((len(middles), 3, 2), np.float32)
    for number, photo in enumerate(photos):
        camera = photo.camera
        x, y, depth = ((mesh.vertices - camera.position) @ camera.axes.T).T
        places = np.stack([x / depth / camera.half_width, y / depth / camera.half_height], axis=1) / 2 + 0.5
        inside = ((places > 0.01) & (places < 0.99)).all(axis=1)[mesh.triangles].all(axis=1)
        facing = np.where(inside, -(normals * unit(middles - camera.position)).sum(axis=1), _UNSEEN)
        better = facing > best
        best[better] = facing[better]
        places[:, 0] = (places[:, 0] + number) / len(photos)
        corners[better] = places[mesh.triangles[better]]
    picture = np.concatenate([photo.picture for photo in photos], axis=1)
    return Colouring(None, (picture,), corners, np.where(best > _UNSEEN, 0, -1).astype(np.int8))


def seen_by(photos: Sequence[Photo], points: np.ndarray, normals: np.ndarray) -> Colouring:
    """Points (n, 3) that face normals (n, 3), coloured by the picture that saw each from straightest above."""
    best, colours = np.full(len(points), _UNSEEN), np.full((len(points), 3), 128, np.uint8)
    for photo in photos:
        camera = photo.camera
        x, y, depth = ((points - camera.position) @ camera.axes.T).T
        places = np.stack([x / depth / camera.half_width, y / depth / camera.half_height], axis=1) / 2 + 0.5
        inside = ((places > 0.01) & (places < 0.99)).all(axis=1)
        facing = np.where(inside, -(normals * unit(points - camera.position)).sum(axis=1), _UNSEEN)
        better = facing > best
        best[better] = facing[better]
        colours[better] = sampled(photo.picture, places[better])
    return Colouring(colours)
