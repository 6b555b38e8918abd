"""From what stands in the file to the chest alone: bed, floor, clutter and stray points gone, even and outward."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.results import CleanScan, LandmarkName, RawScan, Reason, ScanRefused, Unit
from lubdub.scans.crop import near_landmarks
from lubdub.scans.display import begun, draped, light_mesh
from lubdub.scans.normals import Neighbourhood, border, cloud_normals, mesh_normals, neighbourhood, turned_outward
from lubdub.scans.pieces import choose_pieces, is_body_like
from lubdub.scans.planes import find_planes
from lubdub.scans.reasons import LANDMARKS_OFF_SCAN, NO_BODY_FOUND, TOO_FEW_POINTS, TWO_BODIES
from lubdub.scans.thin import Cells, evenly


@dataclass(frozen=True)
class CleanSettings:
    """Sizes of the clean scan and what is too little."""

    points: int = 25_000
    """As many as the paper's; more bought nothing for four points (registration notes, section 2)."""
    work_points: int = 20_000
    """For planes and pieces, over the whole file; the result is then carried to every point."""
    wide_look: float = 2.5
    """A bed is easier to see from farther away: planes are sought in so many times the room kept at the end."""
    second_look: float = 0.3
    """When less than this share of the points was kept, planes and pieces are sought once more in it."""
    least_points: int = 400
    """Below this a nipple is one point or none: 20 by 20 points over a chest are 15 mm apart in an adult."""
    stray_reach: float = 3.0
    """A point whose 6th neighbour is this many times farther than usual is a stray."""
    stray_neighbour: int = 6


SETTINGS = CleanSettings()


def clean(raw: RawScan, unit: Unit, landmarks_in_file: Mapping[LandmarkName, np.ndarray]) -> CleanScan:
    """The chest alone, in millimetres, with the FILE's axes: body_from_file only scales.

    landmarks_in_file: name -> (3,) in the file's coordinates, may be empty; what carries them is never
    removed. Raises ScanRefused when too few points or nothing like a body are left.
    """
    to_mm = Similarity(unit.mm_per_unit, np.eye(3), np.zeros(3))
    landmarks = {name: to_mm.apply(np.asarray(place, float)) for name, place in landmarks_in_file.items()}
    surface = _without_loose_vertices(Surface(to_mm.apply(raw.surface.vertices), raw.surface.triangles))
    _check_count(len(surface.vertices))
    surface = _part(surface, near_landmarks(surface.vertices, landmarks, SETTINGS.wide_look))
    if len(surface.vertices) < SETTINGS.least_points:
        raise ScanRefused(LANDMARKS_OFF_SCAN)
    notes: list[str] = []
    warnings: tuple[Reason, ...] = ()
    for _ in range(2):  # where the body was a small part of the room, a second look sees it in more detail
        keep, done, odd = _body_in(surface.vertices, landmarks)
        surface = _part(surface, keep)
        notes, warnings = notes + done, warnings + odd
        _check_count(len(surface.vertices))
        if keep.mean() > SETTINGS.second_look:
            break
    if not is_body_like(surface.vertices):
        raise ScanRefused(NO_BODY_FOUND)
    return _finished(
        surface, to_mm, unit, tuple(dict.fromkeys(notes)), tuple(dict.fromkeys((*raw.warnings, *warnings)))
    )


def _without_loose_vertices(surface: Surface) -> Surface:
    """A mesh without the vertices that no triangle touches; clouds as they are."""
    if surface.is_cloud:
        return surface
    used = np.zeros(len(surface.vertices), bool)
    used[surface.triangles.ravel()] = True
    return _part(surface, used)


def _part(surface: Surface, keep: np.ndarray) -> Surface:
    return surface if keep.all() else surface.kept(keep)


def _check_count(count: int) -> None:
    if count < SETTINGS.least_points:
        raise ScanRefused(TOO_FEW_POINTS)


def _body_in(
    points: np.ndarray, landmarks: Mapping[LandmarkName, np.ndarray]
) -> tuple[np.ndarray, list[str], tuple[Reason, ...]]:
    """Which points are the body: (n,) bool, what was done in words, and what was odd. Works on few points."""
    places = np.array(list(landmarks.values())).reshape(-1, 3)
    cells = evenly(points, SETTINGS.work_points)
    work = cells.mean(points) if cells.count < len(points) else points
    planes = find_planes(work, places)
    candidate, keep = near_landmarks(work, landmarks), np.ones(len(points), bool)
    for plane in planes:
        candidate &= plane.spares(work)
        keep &= plane.spares(points)
    if candidate.sum() < SETTINGS.least_points / 4:
        raise ScanRefused(NO_BODY_FOUND)
    pieces = choose_pieces(work[candidate], cells.size, places)
    of_body = np.zeros(len(work), bool)
    of_body[np.flatnonzero(candidate)[pieces.keep]] = True
    notes = [f"removed {len(planes)} flat surface{'s' if len(planes) > 1 else ''} (bed, floor or wall)"] * bool(planes)
    if pieces.total > pieces.kept:
        notes.append(f"kept {pieces.kept} of {pieces.total} pieces")
    return keep & of_body[cells.cell], notes, (TWO_BODIES,) if pieces.rival and not len(places) else ()


def _finished(
    surface: Surface, to_mm: Similarity, unit: Unit, notes: tuple[str, ...], warnings: tuple[Reason, ...]
) -> CleanScan:
    surface, cells, points, near = _even(surface)
    by_triangles = mesh_normals(surface, cells)
    normals, was_inside_out = turned_outward(points, _normals(points, near, by_triangles))
    if was_inside_out and by_triangles is not None:
        notes = (*notes, "the surface was inside out and was turned round")
    drape = begun(lambda: draped(points, normals, near) if surface.is_cloud else light_mesh(surface, points, normals))
    return CleanScan(points, normals, border(points, normals, near), drape, to_mm, unit, notes, warnings)


def _even(surface: Surface) -> tuple[Surface, Cells, np.ndarray, Neighbourhood]:
    """The surface without strays, its cubes, one point for each cube, and their neighbours."""
    cells = evenly(surface.vertices, SETTINGS.points)
    points = cells.mean(surface.vertices) if cells.count < len(surface.vertices) else surface.vertices
    near = neighbourhood(points)
    while True:
        reach = near.reach[:, SETTINGS.stray_neighbour]
        keep = reach <= SETTINGS.stray_reach * np.median(reach)
        if keep.all():
            return surface, cells, points, near
        surface = surface.kept(keep[cells.cell])
        _check_count(len(surface.vertices))
        cells, points, near = cells.kept(keep), points[keep], near.kept(keep, points)


def _normals(points: np.ndarray, near: Neighbourhood, by_triangles: np.ndarray | None) -> np.ndarray:
    return cloud_normals(points, near) if by_triangles is None else by_triangles
