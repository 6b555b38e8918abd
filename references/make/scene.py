"""What lies around a person: a bed, a blanket over the legs, a soft toy."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, grey_closing, maximum_filter

from lubdub.geometry.one_thread import one_threaded_open3d
from lubdub.geometry.surface import Surface


def sheet(heights: np.ndarray, x: np.ndarray, y: np.ndarray) -> Surface:
    """A height field as a surface seen from the front. heights: (len(y), len(x)) mm."""
    across, along = np.meshgrid(x, y)
    vertices = np.column_stack([across.ravel(), along.ravel(), heights.ravel()])
    corner = np.arange(heights.size).reshape(heights.shape)
    a, b, c, d = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel(), corner[1:, 1:].ravel(), corner[1:, :-1].ravel()
    return Surface(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def bed(level: float, random: np.random.Generator, half_width: float, foot: float, head: float) -> Surface:
    """A slightly uneven mattress at height z = level, from y = foot to y = head."""
    x, y = np.arange(-half_width, half_width + 1, 20.0), np.arange(foot, head + 1, 20.0)
    bumps = gaussian_filter(random.normal(size=(len(y), len(x))), 4.0)
    return sheet(level + 2.5 * bumps / bumps.std(), x, y)


def blanket(under: Surface, random: np.random.Generator, half_width: float, foot: float, head: float) -> Surface:
    """A blanket with folds over whatever lies beneath it, from y = foot to y = head."""
    x, y = np.arange(-half_width, half_width + 1, 10.0), np.arange(foot, head + 1, 10.0)
    ground = gaussian_filter(maximum_filter(_top(under, x, y), 5), 2.0)
    folds = gaussian_filter(random.normal(size=ground.shape), (6.0, 2.5))
    return sheet(ground + 16.0 + 7.0 * folds / folds.std(), x, y)


def cloth(
    under: Surface,
    random: np.random.Generator,
    across: tuple[float, float],
    along: tuple[float, float],
    thickness: float,
    bridged: float = 24.0,
) -> Surface:
    """A garment over x = across, y = along, so far above the skin, with folds; it spans gaps up to `bridged` wide."""
    pitch = 6.0
    x, y = np.arange(*across, pitch), np.arange(*along, pitch)
    reach = max(1, round(bridged / pitch))
    skin = _top(under, x, y)
    ground = np.maximum(skin, gaussian_filter(grey_closing(skin, (reach, reach)), 1.5))
    folds = gaussian_filter(random.normal(size=ground.shape), (8.0, 3.0))
    return sheet(ground + thickness * np.clip(1.0 + 0.35 * folds / folds.std(), 0.2, 2.0), x, y)


def soft_toy(centre: np.ndarray, radius: float) -> Surface:
    """Two balls, a head on a belly."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3)
    belly = Surface(ball.vertices * [radius, 1.2 * radius, 0.8 * radius] + centre, ball.faces)
    head = Surface(ball.vertices * 0.65 * radius + centre + [0.0, 1.6 * radius, 0.0], ball.faces)
    count = len(belly.vertices)
    return Surface(
        np.concatenate([belly.vertices, head.vertices]), np.concatenate([belly.triangles, head.triangles + count])
    )


def _top(surface: Surface, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(len(y), len(x)) height of the highest surface over a grid; its lowest point where there is none."""
    open3d = one_threaded_open3d()

    caster = open3d.t.geometry.RaycastingScene(nthreads=1)
    caster.add_triangles(surface.vertices.astype(np.float32), surface.triangles.astype(np.uint32))
    across, along = np.meshgrid(x, y)
    above = surface.vertices[:, 2].max() + 100.0
    start = np.stack([across, along, np.full_like(across, above)], axis=-1)
    down = np.broadcast_to([0.0, 0.0, -1.0], start.shape)
    distance = caster.cast_rays(np.concatenate([start, down], axis=-1).astype(np.float32))["t_hit"].numpy()
    return np.where(np.isfinite(distance), above - distance, surface.vertices[:, 2].min())
