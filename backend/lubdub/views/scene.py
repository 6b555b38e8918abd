"""From a scan and its areas to a viser scene: a plaster study of the chest with four marked places.

viser measures in metres here, its defaults suit that; everything arrives in millimetres and `VIEW` converts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import viser

from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.surface import Surface, triangle_normals, unit
from lubdub.results import Area, AreaName, CleanScan, Landmark, LandmarkName, Landmarks, Outcome
from lubdub.views import stickers
from lubdub.views.framing import FIELD_OF_VIEW, framed

VIEW = 0.001
"""Viewer units in one millimetre."""
SKIN = (196, 181, 168)
"""One warm grey-brown for everybody: plaster, not skin."""
FORMER = (92, 92, 92)
PAPER = (251, 248, 243)
SPOKES = 48
SMOOTHED = 3
"""Neighbours on each side over which a circle's height is averaged: a scan's noise must not fray the ring."""
DROP_MM = 60.0
"""From how far outside things are dropped onto the skin: above any bulge within a chestpiece's reach."""
BADGE_SHARE: dict[stickers.Shape, float] = {"circle": 0.6, "square": 0.6, "triangle": 0.76, "diamond": 0.8}
"""Width of the badge within its ring: pointed shapes are larger, or their letters could not be read."""
LIFT_MM = 1.6
"""How far things laid on the skin stand off it, so that they do not flicker through."""
PLATE_SIZE, PLATE_ASIDE, PLATE_DOWN = 0.19, 0.22, 0.78
"""Shares of the way from notch to navel: on the flanks of the belly, clear of arms, ribs' edge and the four areas."""
PLATE_LIFT_MM = 8.0
"""The plates are flat and wide: they stand off a curved flank."""

# Diaphragm diameters from stethoscope makers' data sheets: infant about 25-27, child about 33, adult 43-44 mm.
CHESTPIECE_MM = ((1.0, 26.0), (12.0, 33.0))
ADULT_CHESTPIECE_MM = 44.0


def chestpiece_mm(age_years: float | None) -> float:
    """The diameter of the chestpiece to draw; the child's when the age was not said."""
    if age_years is None:
        return CHESTPIECE_MM[-1][1]
    return next((size for below, size in CHESTPIECE_MM if age_years < below), ADULT_CHESTPIECE_MM)


def light(scene: viser.SceneApi) -> None:
    """Head up, soft three-point light, no environment picture."""
    scene.set_up_direction("+y")
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_hemisphere("/light/room", sky_color=(255, 252, 246), ground_color=(176, 160, 148), intensity=1.15)
    scene.add_light_directional("/light/key", color=(255, 246, 234), intensity=2.1, position=(-0.8, 1.0, 1.2))
    scene.add_light_directional("/light/fill", color=(232, 240, 255), intensity=0.55, position=(1.2, 0.1, 0.8))
    scene.add_light_directional("/light/rim", color=(255, 255, 255), intensity=0.5, position=(0.3, 0.6, -1.2))


@dataclass(frozen=True)
class Sides:
    """What stands on the two plates. letters: a TrueType file that has them; None for those of European languages."""

    right: str = "patient's\nright"
    left: str = "patient's\nleft"
    letters: Path | None = None


def show_body(
    server: viser.ViserServer, scan: CleanScan, landmarks: Landmarks, sides: Sides | None = None
) -> viser.MeshHandle:
    """The skin, the sides named on it, the light and the first camera. Returns the skin to be tapped."""
    light(server.scene)
    server.scene.world_axes.visible = False
    skin = show_skin(server.scene, scan)
    show_sides(server.scene, scan, landmarks, sides or Sides())
    camera = framed(scan, landmarks)
    server.initial_camera.fov = FIELD_OF_VIEW
    server.initial_camera.position = camera.position * VIEW
    server.initial_camera.look_at = camera.look_at * VIEW
    return skin


def show_skin(scene: viser.SceneApi, scan: CleanScan) -> viser.MeshHandle:
    """The skin alone, in place of the one shown before."""
    return scene.add_mesh_simple(
        "/skin",
        scan.display.vertices * VIEW,
        scan.display.triangles,
        color=SKIN,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )


def show_sides(scene: viser.SceneApi, scan: CleanScan, landmarks: Landmarks, sides: Sides) -> None:
    """Plates that say whose left is left, glued to the trunk so that they turn with the body.

    None where no landmark is known: then nobody knows how the body lies.
    """
    if "suprasternal_notch" not in landmarks or "navel" not in landmarks:
        return
    trunk = trunk_mm(scan, landmarks)
    front = float(scan.points[:, 2].max()) + 200.0
    skin = SkinCaster(scan.display)
    for side, sign, words in (("right", -1.0, sides.right), ("left", 1.0, sides.left)):
        start = np.array([sign * PLATE_ASIDE * trunk, -PLATE_DOWN * trunk, front])
        found = _flattest(skin, scan.display, start, PLATE_SIZE * trunk / 2)
        if found is not None:
            plate = stickers.plate(words, sides.letters)
            _lay(scene, f"/sides/{side}", plate, found[0], _facing(found[1]), PLATE_SIZE * trunk, PLATE_LIFT_MM)


def trunk_mm(scan: CleanScan, landmarks: Landmarks) -> float:
    """From the notch to the navel, or to where it should be: the measure for plates and pins."""
    if "navel" in landmarks:
        return max(100.0, -float(landmarks["navel"].position[1]))
    return max(100.0, -0.8 * float(np.percentile(scan.points[:, 1], 2.0)))


def _flattest(
    skin: SkinCaster, surface: Surface, start: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """The skin in front of start (3,), and the mean normal of the skin within reach: noise must not tilt a plate."""
    step = np.linspace(-reach, reach, 5)
    across, along = np.meshgrid(step, step)
    offsets = np.stack([across.ravel(), along.ravel(), np.zeros(across.size)], axis=1)
    hits = skin.cast(start + offsets, np.array([0.0, 0.0, -1.0]))
    middle = len(offsets) // 2
    if not hits.met[middle]:
        return None
    normals = unit(triangle_normals(surface.vertices, surface.triangles[hits.triangle[hits.met]]))
    return hits.points[middle], unit(normals.mean(axis=0))


def show_landmarks(
    scene: viser.SceneApi,
    landmarks: Mapping[LandmarkName, Landmark],
    numbers: Mapping[LandmarkName, int],
    size_mm: float,
) -> dict[LandmarkName, tuple[viser.IcosphereHandle, viser.ImageHandle]]:
    """A pin for each landmark, numbered as in the list beside the view. Returns its ball and its number, to be dragged:
    the ball alone is small for a finger."""
    pins = {}
    for name, landmark in landmarks.items():
        sure = landmark.is_marked
        ball = scene.add_icosphere(
            f"/landmarks/{name}",
            radius=size_mm * 0.42 * VIEW,
            color=stickers.TEAL if sure else (236, 240, 238),
            position=landmark.position * VIEW,
            cast_shadow=False,
            receive_shadow=False,
        )
        colours = (stickers.TEAL, stickers.WHITE) if sure else (stickers.WHITE, stickers.TEAL)
        picture = stickers.badge("circle", str(numbers[name]), *colours)
        place = landmark.position + np.array([0.0, 1.2 * size_mm, 1.5 * size_mm])
        number = _lay(scene, f"/pins/{name}", picture, place, np.array([0.0, 0.0, 1.0]), size_mm * 1.4, lift=0.0)
        pins[name] = (ball, number)
    return pins


def show_outcome(
    server: viser.ViserServer, outcome: Outcome, age_years: float | None = None, sides: Sides | None = None
) -> None:
    """The finished picture: body, four areas, landmarks as small dots. Raises ValueError when nothing was scanned."""
    if outcome.scan is None:
        raise ValueError("there is no scan to show")
    show_body(server, outcome.scan, outcome.landmarks, sides)
    for name, area in outcome.areas.items():
        show_area(server.scene, outcome.scan, name, area, chestpiece_mm(age_years))
    show_dots(server.scene, outcome.landmarks)


def show_dots(scene: viser.SceneApi, landmarks: Landmarks) -> None:
    """Landmarks as small dots, which nobody can take hold of."""
    for name, landmark in landmarks.items():
        place = landmark.position * VIEW
        scene.add_icosphere(
            f"/landmarks/{name}", radius=2.2 * VIEW, color=(110, 100, 92), position=place, cast_shadow=False
        )


def show_area(
    scene: viser.SceneApi, scan: CleanScan, name: AreaName, area: Area, chestpiece: float
) -> tuple[viser.MeshHandle, viser.ImageHandle]:
    """A ring the size of the chestpiece on the skin, the fainter region that may hold the place, and the letter.

    Returns the region and the letter, by which an area can be dragged.
    """
    style = stickers.AREA_STYLES[name]
    region = max(area.radius_mm, 1.0)
    skin = SkinCaster(scan.display)
    normal = _facing(area.normal)
    vertices, triangles = draped_disc(skin, area.position, normal, region)
    patch = scene.add_mesh_simple(
        f"/areas/{name}/region",
        vertices * VIEW,
        triangles,
        color=style.colour,
        opacity=0.38,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )
    ring = draped_circle(skin, area.position, normal, chestpiece / 2)
    for part, thickness, colour, lift in (("edge", 3.4, stickers.INK, 0.0), ("ring", 2.0, style.colour, 0.9)):
        scene.add_spline_catmull_rom(
            f"/areas/{name}/{part}",
            points=(ring + lift * normal) * VIEW,
            closed=True,
            thickness=thickness * VIEW,
            color=colour,
        )
    picture = stickers.badge(style.shape, f"{style.number}{style.letter}", style.colour, style.ink)
    size = BADGE_SHARE[style.shape] * chestpiece
    letter = _lay(scene, f"/areas/{name}/letter", picture, area.position, normal, size, lift=4.8)
    return patch, letter


def show_former(scene: viser.SceneApi, scan: CleanScan, name: AreaName, area: Area, chestpiece: float) -> None:
    """A thin grey ring where an area was computed to be, before somebody moved it."""
    ring = draped_circle(SkinCaster(scan.display), area.position, _facing(area.normal), chestpiece / 2)
    scene.add_spline_catmull_rom(f"/former/{name}", points=ring * VIEW, closed=True, thickness=1.4 * VIEW, color=FORMER)


def draped_circle(skin: SkinCaster, centre: np.ndarray, normal: np.ndarray, radius: float) -> np.ndarray:
    """(SPOKES, 3) a circle of this radius about centre (3,), dropped along -normal (3,) onto the skin."""
    right, up = _tangents(normal)
    angles = np.linspace(0.0, 2 * np.pi, SPOKES, endpoint=False)
    flat = centre + radius * (np.cos(angles)[:, None] * right + np.sin(angles)[:, None] * up)
    heights = (_dropped(skin, flat, normal) - flat) @ normal
    smooth = np.mean([np.roll(heights, shift) for shift in range(-SMOOTHED, SMOOTHED + 1)], axis=0)
    return flat + smooth[:, None] * normal


def draped_disc(
    skin: SkinCaster, centre: np.ndarray, normal: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """A filled disc on the skin: vertices (n, 3) and triangles (m, 3), facing along normal."""
    rings = 5
    circles = [draped_circle(skin, centre, normal, radius * (k + 1) / rings) for k in range(rings)]
    vertices = np.concatenate([_dropped(skin, centre[None], normal), *circles])
    spoke = np.arange(SPOKES)
    following = (spoke + 1) % SPOKES
    triangles = [np.stack([np.zeros(SPOKES, int), 1 + spoke, 1 + following], axis=1)]
    for k in range(rings - 1):
        inner, outer = 1 + k * SPOKES, 1 + (k + 1) * SPOKES
        triangles.append(np.stack([inner + spoke, outer + spoke, outer + following], axis=1))
        triangles.append(np.stack([inner + spoke, outer + following, inner + following], axis=1))
    return vertices, np.concatenate(triangles)


def _dropped(skin: SkinCaster, points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Points (k, 3) moved along the normal onto the skin, or left where they are beside it."""
    hits = skin.cast(points + DROP_MM * normal, -normal)
    return np.where(hits.met[:, None], hits.points, points) + LIFT_MM * normal


def _facing(normal: np.ndarray) -> np.ndarray:
    """The normal leaning half-way to the front, so that a letter on the flank can still be read."""
    return unit(unit(normal) + np.array([0.0, 0.0, 0.8]))


def _tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right (screen) and up (head) directions, (3,) each, in the plane across normal (3,)."""
    right = unit(np.cross(np.array([0.0, 1.0, 0.0]), normal))
    return right, np.cross(normal, right)


def _lay(
    scene: viser.SceneApi,
    name: str,
    picture: np.ndarray,
    place: np.ndarray,
    normal: np.ndarray,
    width_mm: float,
    lift: float,
) -> viser.ImageHandle:
    """A picture upright in the plane across normal, its middle `lift` mm off the place."""
    right, up = _tangents(normal)
    # viser shows pictures with x to the right, y down and the face towards -z.
    turned = np.stack([right, -up, -normal], axis=1)
    return scene.add_image(
        name,
        picture,
        render_width=width_mm * VIEW,
        render_height=width_mm * picture.shape[0] / picture.shape[1] * VIEW,
        format="png",
        wxyz=viser.transforms.SO3.from_matrix(turned).wxyz,
        position=(place + lift * normal) * VIEW,
        cast_shadow=False,
        receive_shadow=False,
    )
