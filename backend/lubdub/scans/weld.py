"""Meshes whose triangles share no corners, made whole again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.results import RawScan
from lubdub.scans.read_stl import join_equal


def welded(raw: RawScan) -> RawScan:
    """The scan with equal corners joined, when it has far more of them than a whole mesh can have.

    Some exporters give every triangle corners of its own, to lay pictures over them. Then points no longer show how
    far apart the skin's points are. A closed mesh has half as many vertices as triangles.
    """
    vertices, triangles = raw.surface.vertices, raw.surface.triangles
    if raw.surface.is_cloud or len(vertices) <= len(triangles):
        return raw
    _, index = join_equal(vertices.astype(np.float32))
    first = np.unique(index, return_index=True)[1]
    if len(first) == len(vertices):
        return raw
    colouring = raw.colouring
    if colouring is not None and colouring.vertices is not None:
        colouring = replace(colouring, vertices=colouring.vertices[first])
    return replace(raw, surface=Surface(vertices[first], index[triangles]), colouring=colouring)
