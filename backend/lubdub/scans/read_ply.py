"""PLY: text and both binary orders, meshes and clouds. Colours and whatever else it carries are left alone."""

from __future__ import annotations

import numpy as np

from lubdub.results import RawScan
from lubdub.scans.limits import check_counts, checked_surface, fan
from lubdub.scans.ply_header import Element, Header, read_header
from lubdub.scans.ply_lists import polygons_in_bytes
from lubdub.scans.reasons import unreadable
from lubdub.scans.tables import number_table, polygon_table

_FACE_LISTS = ("vertex_indices", "vertex_index")
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
    vertices, triangles = _read_text(data, header) if not header.byte_order else _read_binary(data, header)
    return RawScan(checked_surface(vertices, triangles), "ply")


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
    vertices, triangles, at = np.zeros((0, 3)), np.zeros((0, 3), np.int64), header.body_start
    for element in header.elements:
        if element.name == "face" and element.count:
            polygons, at = polygons_in_bytes(data, at, element, _list_place(element), header.byte_order)
            triangles = np.concatenate([fan(same_length) for same_length in polygons])
        elif element.has_list and element.count:
            raise unreadable("bad_header")
        else:
            rows, at = _scalar_rows(data, at, element, header.byte_order)
            if element.name == "vertex":
                vertices = np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1)
        if _is_last_needed(header, element):
            break
    return vertices, triangles


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
    vertices, triangles, at = np.zeros((0, 3)), np.zeros((0, 3), np.int64), 0
    for element in header.elements:
        rows = lines[at : at + element.count]
        if len(rows) < element.count:
            raise unreadable("cut_short")
        at += element.count
        if element.name == "vertex":
            names = [one.name for one in element.properties]
            vertices = number_table(rows, [names.index(axis) for axis in "xyz"])
        elif element.name == "face" and element.count:
            place = _list_place(element)
            corner_counts = number_table(rows, (place,), whole=True)[:, 0]
            triangles = polygon_table(rows, corner_counts, first_column=place + 1)
    return vertices, triangles
