"""Shaded pictures of bodies, for looking at them; nothing in the product reads these."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lubdub.geometry.one_thread import one_threaded_open3d

VIEWS = {
    "front": (np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, 1.0])),
    "left": (np.array([0, 0, -1.0]), np.array([0, 1.0, 0]), np.array([1.0, 0, 0])),
}
"""Picture axes: right, up, towards the viewer. Seen from the front the patient's left is on the right."""


def shade(
    vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray, view: str = "front", size: int = 360
) -> np.ndarray:
    """(size, size, 3) uint8: the mesh in parallel projection with dots on it. points: (k, 3)."""
    open3d = one_threaded_open3d()

    right, up, towards = VIEWS[view]
    centre, span = (vertices.max(0) + vertices.min(0)) / 2, 1.05 * np.ptp(vertices, axis=0).max()
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.astype(np.float32), triangles.astype(np.uint32))
    grid = (np.arange(size) + 0.5) / size - 0.5
    across, down = np.meshgrid(grid, -grid)
    start = centre + span * (across[..., None] * right + down[..., None] * up + towards)
    rays = np.concatenate([start, np.broadcast_to(-towards, start.shape)], axis=-1).astype(np.float32)
    hit = scene.cast_rays(rays)
    light = np.abs(hit["primitive_normals"].numpy() @ (0.3 * right + 0.35 * up + 0.9 * towards))
    image = np.where(np.isfinite(hit["t_hit"].numpy()), 40 + 190 * np.clip(light, 0, 1), 255)
    picture = np.repeat(image[..., None], 3, axis=-1).astype(np.uint8)
    colours = [
        (0, 0, 0),
        (0, 0, 0),
        (0, 0, 0),
        (120, 60, 0),
        (120, 60, 0),
        (230, 0, 0),
        (0, 90, 255),
        (0, 160, 0),
        (255, 0, 255),
    ]
    for point, colour in zip(points, colours, strict=False):
        column = int(((point - centre) @ right / span + 0.5) * size)
        row = int((0.5 - (point - centre) @ up / span) * size)
        picture[max(row - 3, 0) : row + 4, max(column - 3, 0) : column + 4] = colour
    return picture


def save_sheet(pictures: list[np.ndarray], path: Path, columns: int = 6) -> None:
    """Many pictures on one sheet."""
    from PIL import Image

    height, width = pictures[0].shape[:2]
    rows = -(-len(pictures) // columns)
    sheet = np.full((rows * height, columns * width, 3), 255, np.uint8)
    for place, picture in enumerate(pictures):
        row, column = divmod(place, columns)
        sheet[row * height : (row + 1) * height, column * width : (column + 1) * width] = picture
    Image.fromarray(sheet).save(path)
