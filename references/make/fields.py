"""Displacement fields on a torso: sliding along the skin, stretching along the body, smooth random ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import LinearNDInterpolator, PchipInterpolator

from lubdub.geometry.surface import triangle_normals, vertex_normals

SLOPE_LIMIT = 1.5
"""A slide never climbs steeper than this; beyond it the frontal view says nothing about depth."""


def front_share(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) 1 where skin faces the front, falling smoothly to 0 where it faces sideways."""
    return smoothstep(vertex_normals(vertices, triangles)[:, 2], 0.1, 0.5)


def smoothstep(value: np.ndarray, start: float, end: float) -> np.ndarray:
    """0 below start, 1 above end, smooth between."""
    share = np.clip((value - start) / (end - start), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def slide_on_skin(vertices: np.ndarray, shift: np.ndarray, front: np.ndarray, ironed_mm: float = 0.0) -> np.ndarray:
    """(n, 3) displacement that moves vertices by shift (n, 2) in frontal view and keeps them on the skin.

    The surface stays as it is; only which vertex marks which place changes. front: (n,) from `front_share`,
    already without the arms. With ironed_mm the slope followed is that of the chest ironed smooth over so many
    mm: then hills such as breasts travel along instead of being left behind.
    """
    facing = front > 0.02
    places, depth = vertices[facing, :2], vertices[facing, 2]
    if ironed_mm > 0:
        depth = _ironed(places, depth, front[facing], ironed_mm)
    height = LinearNDInterpolator(places, depth)
    wanted = shift * front[:, None]
    rise = height(vertices[:, :2] + wanted) - height(vertices[:, :2])
    limit = SLOPE_LIMIT * np.linalg.norm(wanted, axis=1)
    rise = np.clip(np.nan_to_num(rise), -limit, limit)
    return np.column_stack([wanted, front * rise])


def _ironed(places: np.ndarray, depth: np.ndarray, weight: np.ndarray, reach: float) -> np.ndarray:
    """Local linear regression of depth over the frontal view: smooth, and true to slopes up to the rim."""
    offset = places[None] - places[:, None]
    share = weight * np.exp(-0.5 * (offset**2).sum(-1) / reach**2)
    design = np.concatenate([np.ones((*share.shape, 1)), offset], axis=-1)
    weighted = design * share[..., None]
    normal = np.swapaxes(weighted, 1, 2) @ design
    right = np.einsum("ijk,j->ik", weighted, depth)
    return np.asarray(np.linalg.solve(normal, right[..., None])[:, 0, 0])


def along_body(y: np.ndarray, levels: Sequence[float], shifts: Sequence[float]) -> np.ndarray:
    """(n,) a smooth monotone-between-knots profile of shifts over the height y; constant beyond the ends."""
    order = np.argsort(levels)
    knots, values = np.asarray(levels, np.float64)[order], np.asarray(shifts, np.float64)[order]
    return np.asarray(PchipInterpolator(knots, values)(np.clip(y, knots[0], knots[-1])))


def bump(vertices: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """(n,) a Gaussian hill around centre (3,), 1 there."""
    return np.exp(-0.5 * ((vertices - centre) ** 2).sum(axis=1) / radius**2)


def area_share(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) the skin each vertex stands for, against the median, at most 1: the rings of a nipple are dense."""
    per_triangle = np.linalg.norm(triangle_normals(vertices, triangles), axis=1) / 6
    area = np.bincount(triangles.ravel(), np.repeat(per_triangle, 3), len(vertices))
    return np.clip(area / np.median(area), 0.02, 1.0)


def smooth_modes(vertices: np.ndarray, share: np.ndarray, reach: float, amplitude: float, count: int) -> np.ndarray:
    """(3 * count, n, 3) directions of a random smooth field whose points move by `amplitude` (rms).

    The principal components of a Gaussian process with correlation exp(-d^2 / 4 reach^2): what a sum of many
    Gaussian hills of radius `reach` at random places looks like. share: (n,) weight of each vertex.
    """
    squared, root = (vertices**2).sum(1), np.sqrt(share)
    distance = squared[:, None] + squared[None] - 2 * vertices @ vertices.T
    correlation = np.exp(-np.clip(distance, 0, None) / (4 * reach**2))
    values, vectors = np.linalg.eigh(correlation * root[:, None] * root[None])
    kept = vectors[:, ::-1][:, :count] * np.sqrt(np.clip(values[::-1][:count], 0, None)) / root[:, None]
    kept = kept * signs_fixed(kept.T)[None] * amplitude / np.sqrt(3.0)
    return np.einsum("nk,ad->kand", kept, np.eye(3)).reshape(-1, len(vertices), 3)


def signs_fixed(rows: np.ndarray) -> np.ndarray:
    """(k,) +1 or -1 so that each row's largest entry becomes positive: eigenvectors have no sign of their own."""
    largest = np.abs(rows).argmax(axis=1)
    return np.where(rows[np.arange(len(rows)), largest] < 0, -1.0, 1.0)


def random_smooth_field(
    random: np.random.Generator, places: np.ndarray, around: np.ndarray, reach: float, amplitude: float
) -> np.ndarray:
    """(k, 3) displacements at places (k, 3): 40 Gaussian hills at random vertices of `around` (n, 3), rms there."""
    centres = around[random.integers(0, len(around), 40)]
    directions = random.normal(size=(40, 3))

    def field(at: np.ndarray) -> np.ndarray:
        squared = ((at[:, None] - centres[None]) ** 2).sum(-1)
        return np.exp(-squared / (2 * reach**2)) @ directions

    scale = amplitude / np.sqrt((field(around) ** 2).sum(1).mean())
    return scale * field(places)
