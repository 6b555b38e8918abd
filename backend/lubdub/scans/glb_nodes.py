"""Where a GLB's nodes put its meshes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from lubdub.scans.limits import LIMITS
from lubdub.scans.reasons import unreadable


def placed_meshes(document: Mapping[str, Any]) -> Iterator[tuple[int, np.ndarray]]:
    """Each mesh's number with its (4, 4) matrix into the scene; a mesh used twice comes twice.

    Raises ScanUnreadable when nodes form a ring, are shared, or are too many.
    """
    nodes = document.get("nodes", [])
    if not nodes:
        yield from ((number, np.eye(4)) for number in range(len(document["meshes"])))
        return
    if len(nodes) > LIMITS.glb_nodes:
        raise unreadable("bad_header")
    waiting = [(root, np.eye(4)) for root in _roots(document, nodes)]
    seen: set[int] = set()
    while waiting:
        number, above = waiting.pop()
        if number in seen or not 0 <= number < len(nodes):
            raise unreadable("bad_header")
        seen.add(number)
        here = above @ _own_matrix(nodes[number])
        waiting += [(child, here) for child in nodes[number].get("children", [])]
        if "mesh" in nodes[number]:
            yield nodes[number]["mesh"], here


def _roots(document: Mapping[str, Any], nodes: list[Mapping[str, Any]]) -> list[int]:
    scenes = document.get("scenes", [])
    if scenes:
        return list(scenes[document.get("scene", 0)].get("nodes", []))
    children = {child for node in nodes for child in node.get("children", [])}
    return [number for number in range(len(nodes)) if number not in children]


def _own_matrix(node: Mapping[str, Any]) -> np.ndarray:
    """The node's matrix, or translation @ rotation @ scale; quaternions are x, y, z, w."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], np.float64).reshape(4, 4).T
    else:
        matrix = np.eye(4)
        turn = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64).reshape(4)
        scale = np.array(node.get("scale", (1, 1, 1)), np.float64).reshape(3)
        matrix[:3, :3] = Rotation.from_quat(turn).as_matrix() * scale
        matrix[:3, 3] = np.array(node.get("translation", (0, 0, 0)), np.float64).reshape(3)
    if not (np.abs(matrix).max() < LIMITS.coordinate):  # also False for nan
        raise unreadable("bad_number")
    return matrix
