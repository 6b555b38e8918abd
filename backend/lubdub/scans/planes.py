"""Beds, floors, tables and walls: large flat things with the body on one side and almost nothing on the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from lubdub.scans.thin import bounds, cells_of, spacing


@dataclass(frozen=True)
class PlaneSettings:
    """Lengths in millimetres. Measured on simulated beds, and on one scanned body laid on them."""

    patch: float = 40.0
    """Edge of the cubes whose points are tried as part of a plane: a bed is flat over a hand's breadth."""
    patch_points: int = 8
    patch_roughness: float = 9.0
    """Depth cameras and phone meshes are 1-5 mm rough on a bed, and rougher on a floor farther away."""
    near: float = 7.0
    """A point this near lies in the plane."""
    clear: float = 20.0
    """A point farther than this lies surely off it."""
    least_share: float = 0.006
    """Below this share of all points no bed was worth removing."""
    behind_share: float = 0.01
    """Strays and wrinkles behind a bed."""
    body_free_area: float = 250_000.0
    """No flat part of a person is this large: an adult's whole front holds less than 100,000 square mm. So it
    goes, whatever lies behind: a floor behind a bed, or the bed's own side."""
    least_outside: float = 0.5
    """More than half of a bed is not under the body."""
    step_share: float = 0.35
    """Just in front of a bed there is little; just behind a belly's top there is more of the belly. A bed also
    reaches beyond the body, and a belly's top does not."""
    drop: tuple[float, float] = (8.0, 16.0)
    """Removed with the plane: three times its roughness, within these bounds."""
    landmark_clearance: float = 20.0
    """The five landmarks lie on the front, so a plane this near to one is the body."""
    search_points: int = 10_000
    """A square metre at 10 mm: enough to see a bed."""
    most_planes: int = 6
    most_tries: int = 12


SETTINGS = PlaneSettings()


@dataclass(frozen=True)
class Plane:
    """Points x with normal @ x > offset are in front, where the body is. normal: (3,) unit."""

    normal: np.ndarray
    offset: float
    drop: float = 0.0
    """Points up to this far in front go with the plane."""
    behind: float = np.inf
    """Points up to this far behind go with it: all, unless something large lies there."""

    def height(self, points: np.ndarray) -> np.ndarray:
        """(n,) signed distance of points (n, 3), positive in front."""
        return np.asarray(points @ self.normal - self.offset)

    def flipped(self) -> Plane:
        """The same plane seen from the other side."""
        return Plane(-self.normal, -self.offset)

    def spares(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool: False for the points (n, 3) that belong to the plane."""
        height = self.height(points)
        return np.asarray((height > self.drop) | (height < -self.behind))


def find_planes(points: np.ndarray, landmarks: np.ndarray) -> list[Plane]:
    """The planes to remove, each with its front side towards the body.

    points: (n, 3) in mm, evenly spread; landmarks: (k, 3), k may be 0: these are never behind a plane.
    """
    found: list[Plane] = []
    points = points[:: -(-len(points) // SETTINGS.search_points)]
    while len(found) < SETTINGS.most_planes and len(points) >= 4 * SETTINGS.patch_points:
        judged = (_judged(candidate, points, landmarks) for candidate in _candidates(points))
        plane = next((one for one in judged if one is not None), None)
        if plane is None:
            break
        found.append(plane)
        points = points[plane.spares(points)]
    return found


@dataclass(frozen=True)
class _Patches:
    middles: np.ndarray
    normals: np.ndarray
    weights: np.ndarray


def _flat_patches(points: np.ndarray) -> _Patches:
    """Cubes whose points lie in a plane: middles (p, 3), normals (p, 3), number of points (p,)."""
    cells = cells_of(points, SETTINGS.patch)
    weights = np.bincount(cells.cell, minlength=cells.count)
    middles = cells.mean(points)
    off = points - middles[cells.cell]
    products = np.stack([off[:, i] * off[:, j] for i in range(3) for j in range(i, 3)], axis=1)
    moments = cells.mean(products)[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    spread, axes = np.linalg.eigh(moments)
    spread = np.sqrt(np.maximum(spread, 0))
    flat = (weights >= SETTINGS.patch_points) & (spread[:, 0] < SETTINGS.patch_roughness)
    flat &= spread[:, 1] > 1.2 * spread[:, 0]
    return _Patches(middles[flat], axes[flat, :, 0], weights[flat])


def _candidates(points: np.ndarray) -> Iterator[Plane]:
    """Planes that many patches agree on, the largest first."""
    patches = _flat_patches(points)
    open_ = np.ones(len(patches.weights), bool)
    tried = np.argsort(-patches.weights, kind="stable")[:: max(len(patches.weights) // 400, 1)]
    seeds = tried[:400]
    votes = _votes(patches, seeds)
    for _ in range(SETTINGS.most_tries):
        support = (votes & open_).astype(np.float64) @ patches.weights
        support[~open_[seeds]] = 0
        if len(support) == 0 or support.max() < SETTINGS.least_share * len(points):
            return
        best = int(support.argmax())
        seed = seeds[best]
        yield _refined(Plane(patches.normals[seed], float(patches.normals[seed] @ patches.middles[seed])), points)
        open_ &= ~votes[best]
        open_[seed] = False


def _votes(patches: _Patches, seeds: np.ndarray) -> np.ndarray:
    """(s, p) bool: does patch p lie in the plane of seed s?"""
    normals = patches.normals[seeds]
    offsets = (normals * patches.middles[seeds]).sum(axis=1)
    near = np.abs(normals @ patches.middles.T - offsets[:, None]) < 2 * SETTINGS.near
    return near & (np.abs(normals @ patches.normals.T) > np.cos(np.radians(15)))


def _refined(plane: Plane, points: np.ndarray) -> Plane:
    """Least squares over the points near the plane, three times and ever nearer."""
    for reach in (3 * SETTINGS.near, 2 * SETTINGS.near, SETTINGS.near):
        near = points[np.abs(plane.height(points)) < reach]
        if len(near) < SETTINGS.patch_points:
            return plane
        middle = near.mean(axis=0)
        normal = np.linalg.eigh((near - middle).T @ (near - middle))[1][:, 0]
        plane = Plane(normal, float(normal @ middle))
    return plane


def _judged(plane: Plane, points: np.ndarray, landmarks: np.ndarray) -> Plane | None:
    """The plane with its front towards the body, or None when it might be part of the body."""
    height = plane.height(points)
    if len(landmarks):
        above = plane.height(landmarks)
        if np.abs(above).min() < SETTINGS.landmark_clearance or (above > 0).any() != (above > 0).all():
            return None
        turned = bool(above[0] < 0)
    else:
        turned = bool((height > SETTINGS.clear).sum() < (height < -SETTINGS.clear).sum())
    if turned:
        plane, height = plane.flipped(), -height
    near = np.abs(height) < SETTINGS.near
    if near.sum() < SETTINGS.least_share * len(points) or not _stands_apart(plane, points, height, len(landmarks) > 0):
        return None
    drop = float(np.clip(3 * np.std(height[np.abs(height) < 2 * SETTINGS.near]), *SETTINGS.drop))
    is_last = len(landmarks) or (height < -SETTINGS.clear).mean() < SETTINGS.behind_share
    return Plane(plane.normal, plane.offset, drop, np.inf if is_last else drop)


def _stands_apart(plane: Plane, points: np.ndarray, height: np.ndarray, side_is_known: bool) -> bool:
    near, rest = np.abs(height) < SETTINGS.near, height > SETTINGS.clear
    behind = float((height < -SETTINGS.clear).mean())
    flat = _in_plane(plane, points)
    pixel = max(SETTINGS.clear, 2 * spacing(points))
    low, high = bounds(flat)
    pixels = ((flat - low) / pixel).astype(np.int64)
    shape = tuple(((high - low) / pixel).astype(np.int64) + 1)
    area = np.count_nonzero(_raster(pixels[near], shape)) * pixel * pixel
    if area > SETTINGS.body_free_area:
        return True
    if behind > SETTINGS.behind_share and not side_is_known:
        return False
    just_before = (height > SETTINGS.near) & (height < 3 * SETTINGS.near)
    if just_before.sum() > SETTINGS.step_share * near.sum() or _scatter(flat[near]) < _scatter(flat[rest]):
        return False
    shadow = np.pad(_raster(pixels[rest], shape), 2)
    shadow = ndimage.binary_fill_holes(ndimage.binary_closing(shadow, iterations=2))[2:-2, 2:-2]
    return float(1 - shadow[tuple(pixels[near].T)].mean()) > SETTINGS.least_outside


def _in_plane(plane: Plane, points: np.ndarray) -> np.ndarray:
    """(n, 2) coordinates within the plane."""
    first = np.cross(plane.normal, np.eye(3)[np.abs(plane.normal).argmin()])
    first /= np.linalg.norm(first)
    return np.asarray(points @ np.stack([first, np.cross(plane.normal, first)], axis=1))


def _raster(pixels: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The picture of the given shape, True where a pixel (n, 2) is named."""
    picture = np.zeros(shape, bool)
    picture[pixels[:, 0], pixels[:, 1]] = True
    return picture


def _scatter(flat: np.ndarray) -> float:
    """Mean squared distance of points (n, 2) from their middle."""
    return sum(float(column.var()) for column in flat.T) if len(flat) else 0.0
