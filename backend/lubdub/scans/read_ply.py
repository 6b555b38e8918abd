"""PLY: text and both binary orders, meshes and clouds, with the colours of their vertices."""

from __future__ import annotations

import numpy as np

from lubdub.geometry.colour import Colouring
from lubdub.results import RawScan
from lubdub.scans.limits import check_counts, check_rest, checked_surface, fan
from lubdub.scans.ply_header import Element, Header, read_header
from lubdub.scans.ply_lists import polygons_in_bytes
from lubdub.scans.reasons import unreadable
from lubdub.scans.tables import check_columns, number_table, polygon_table

_FACE_LISTS = ("vertex_indices", "vertex_index")
_COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_SPLAT_SIGNS = ({"f_dc_0"}, {"opacity", "scale_0", "rot_0"})


def read_ply(data: bytes) -> RawScan:
    """Read a PLY. Raises ScanUnreadable when it is damaged, cut short or a Gaussian splat."""
    header = read_header(data)
    vertex = next((element for element in header.elements if element.name == "vertex"), None)
    face = next((element for element in header.elements if element.name == "face"), None)
    if vertex is None or vertex.has_list:
        raise unreadable("bad_header")
    names = [one.name for one in vertex.properties]
    if any(signs <= set(names) for signs in _SPLAT_SIGNS):
        raise unreadable("splat")
    if len(set(names)) != len(names) or not {"x", "y", "z"} <= set(names):
        raise unreadable("bad_header")
    check_counts(vertex.count, face.count if face else 0)
    columns, triangles = _read_text(data, header) if not header.byte_order else _read_binary(data, header)
    colouring = Colouring(_as_bytes(columns[:, 3:], vertex)) if columns.shape[1] == 6 else None
    return RawScan(checked_surface(columns[:, :3], triangles), "ply", colouring=colouring)


def _wanted(vertex: Element) -> list[str]:
    """The properties to read: the place, and the colour when there is one."""
    names = [one.name for one in vertex.properties]
    colour = next((three for three in _COLOURS if set(three) <= set(names)), ())
    return ["x", "y", "z", *colour]


def _as_bytes(colours: np.ndarray, vertex: Element) -> np.ndarray:
    """(n, 3) uint8: whole numbers are taken as bytes or as words of 16 bits, fractions as shares of white."""
    kind = next(one.kind for one in vertex.properties if one.name == _wanted(vertex)[3])
    scale = {"u1": 1.0, "u2": 1 / 257, "f4": 255.0, "f8": 255.0}.get(kind, 1.0)
    return np.clip(np.nan_to_num(colours * scale), 0, 255).astype(np.uint8)


def _is_last_needed(header: Header, element: Element) -> bool:
    later = header.elements[header.elements.index(element) + 1 :]
    return not any(one.name in ("vertex", "face") and one.count for one in later)


def _list_place(face: Element) -> int:
    """Where among the face's properties its corners stand; they must be its first list."""
    for place, one in enumerate(face.properties):
        if one.count_kind is not None:
            if one.name in _FACE_LISTS:
                return place
            break
    raise unreadable("bad_header")


def _read_binary(data: bytes, header: Header) -> tuple[np.ndarray, np.ndarray]:
    columns, triangles, at = np.zeros((0, 3)), np.zeros((0, 3), np.int64), header.body_start
    for element in header.elements:
        if element.name == "face" and element.count:
            polygons, at = polygons_in_bytes(data, at, element, _list_place(element), header.byte_order)
            triangles = np.concatenate([fan(same_length) for same_length in polygons])
        elif element.has_list and element.count:
            raise unreadable("bad_header")
        else:
            rows, at = _scalar_rows(data, at, element, header.byte_order)
            if element.name == "vertex":
                columns = np.stack([rows[name].astype(np.float64) for name in _wanted(element)], axis=1)
        if not any(later.count for later in header.elements[header.elements.index(element) + 1 :]):
            check_rest(data, at)
        if _is_last_needed(header, element):
            break
    return columns, triangles


def _scalar_rows(data: bytes, at: int, element: Element, byte_order: str) -> tuple[np.ndarray, int]:
    # Positions as names for other elements: theirs may repeat or be odd, and nobody reads them.
    by_name = element.name == "vertex"
    row = np.dtype([(p.name if by_name else f"p{i}", byte_order + p.kind) for i, p in enumerate(element.properties)])
    end = at + row.itemsize * element.count
    if end > len(data):
        raise unreadable("cut_short")
    if not row.itemsize:
        return np.zeros(0, row), at
    return np.frombuffer(data, row, element.count, at), end


def _read_text(data: bytes, header: Header) -> tuple[np.ndarray, np.ndarray]:
    lines = [line for line in data[header.body_start :].splitlines() if line.strip()]
    columns, triangles, at = np.zeros((0, 3)), np.zeros((0, 3), np.int64), 0
    for element in header.elements:
        rows = lines[at : at + element.count]
        if len(rows) < element.count:
            raise unreadable("cut_short")
        at += element.count
        if element.name == "vertex":
            names = [one.name for one in element.properties]
            check_columns(rows, len(names))
            columns = number_table(rows, [names.index(name) for name in _wanted(element)])
        elif element.name == "face" and element.count:
            place = _list_place(element)
            corner_counts = number_table(rows, (place,), whole=True)[:, 0]
            if len(element.properties) == 1 and any(
                len(row.split()) != 1 + count for row, count in zip(rows, corner_counts.tolist(), strict=True)
            ):
                raise unreadable("bad_face")
            triangles = polygon_table(rows, corner_counts, first_column=place + 1)
    if len(lines) > at:
        raise unreadable("too_long")
    return columns, triangles
