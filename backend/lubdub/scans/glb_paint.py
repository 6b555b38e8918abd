"""The colours of a GLB: vertex colours (COLOR_0) and base colour textures embedded in the file.

The geometry is read whatever becomes of the colours: what cannot be used of them is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lubdub.geometry.colour import Colouring
from lubdub.results import ScanUnreadable
from lubdub.scans.glb_accessors import Accessors
from lubdub.scans.pictures import Album

_FAULTS = (KeyError, IndexError, TypeError, AttributeError, OverflowError, ValueError, ScanUnreadable)
_GREY = 128
_FAR = 1e4  # times the picture repeats; also keeps nan and infinity out


class Paint:
    """Gathers the colours of one primitive after the other, in the order in which their triangles are kept."""

    def __init__(self, document: Mapping[str, Any], accessors: Accessors) -> None:
        """Over the parsed document."""
        self._document = document
        self._accessors = accessors
        self._album = Album()
        self._vertices: list[tuple[int, np.ndarray | None]] = []
        self._triangles: list[tuple[int, tuple[np.ndarray, int] | None]] = []

    def add(self, primitive: Mapping[str, Any], vertex_count: int, triangles: np.ndarray) -> None:
        """One primitive's colours. triangles: (m, 3) numbers of its own vertices."""
        self._vertices.append((vertex_count, self._of_vertices(primitive, vertex_count)))
        found = self._places(primitive, vertex_count)
        laid = None if found is None else (found[0][triangles], found[1])
        self._triangles.append((len(triangles), laid))

    def colouring(self) -> Colouring | None:
        """All of it, None when the file has no colour that we can use."""
        vertices = None
        if any(colours is not None for _, colours in self._vertices):
            parts = [np.full((n, 3), _GREY, np.uint8) if one is None else one for n, one in self._vertices]
            vertices = np.concatenate(parts)
        if not self._album.pictures:
            return None if vertices is None else Colouring(vertices)
        nowhere = [(np.zeros((n, 3, 2), np.float32), -1) if laid is None else laid for n, laid in self._triangles]
        corners = np.concatenate([places for places, _ in nowhere])
        numbers = np.concatenate([np.full(len(places), number, np.int8) for places, number in nowhere])
        return Colouring(vertices, tuple(self._album.pictures), corners, numbers)

    def _of_vertices(self, primitive: Mapping[str, Any], vertex_count: int) -> np.ndarray | None:
        number = primitive["attributes"].get("COLOR_0")
        if number is None:
            return None
        try:
            shares = self._accessors.shares(number, ("VEC3", "VEC4"))[:, :3]
        except _FAULTS:
            return None
        if len(shares) != vertex_count:
            return None
        return (np.clip(np.nan_to_num(shares), 0, 1) * 255).astype(np.uint8)

    def _places(self, primitive: Mapping[str, Any], vertex_count: int) -> tuple[np.ndarray, int] | None:
        """(n, 2) where each vertex lies in its picture, and that picture's number."""
        if "material" not in primitive:
            return None
        try:
            material = self._document["materials"][primitive["material"]]
            texture = material["pbrMetallicRoughness"]["baseColorTexture"]
            name = f"TEXCOORD_{texture.get('texCoord', 0)}"
            places = self._accessors.shares(primitive["attributes"][name], ("VEC2",))
            if len(places) != vertex_count or not (np.abs(places) < _FAR).all():
                return None
            source = self._document["textures"][texture["index"]]["source"]
            view = self._document["images"][source]["bufferView"]
            picture = self._album.number(source, lambda: self._accessors.view(view))
        except _FAULTS:
            return None
        return None if picture is None else (places, picture)
