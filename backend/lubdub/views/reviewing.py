"""A live view in which a clinician judges a result: the skin, the fitted body, where they part, and areas to drag."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
import viser

from lubdub.geometry.raycast import SkinCaster
from lubdub.results import LANDMARK_NAMES, AreaName, LandmarkName, Landmarks, Outcome
from lubdub.views.framing import close_to, framed
from lubdub.views.hands import dragged_to, stand
from lubdub.views.placing import NUMBERS, PIN_SHARE
from lubdub.views.scene import (
    VIEW,
    Sides,
    chestpiece_mm,
    show_area,
    show_body,
    show_dots,
    show_former,
    show_landmarks,
    trunk_mm,
)

Layer = Literal["skin", "fitted", "misfit"]
LAYERS: tuple[Layer, ...] = ("skin", "fitted", "misfit")
MISFIT_MM = (0.0, 5.0, 10.0)
MISFIT_COLOURS = np.array([[243, 235, 221], [230, 159, 0], [110, 26, 90]], float)
"""Light to dark, so that it reads without colour too: no gap, 5 mm, 10 mm and more."""
FITTED = (15, 118, 110)
REVIEW_PIN = 0.6
"""Pins are there to be checked, not to be hit with a thumb: smaller than where a family places them."""

AreaMoved = Callable[[AreaName, np.ndarray], None]
LandmarkMoved = Callable[[LandmarkName, np.ndarray], None]
"""Called with a name and the new place (3,), mm, body frame, on the shown skin."""


@dataclass(frozen=True)
class Shown:
    """What is to be seen. outcome: with the areas and landmarks as they are now; is_before: as they were computed;
    has_pins: landmarks as numbered pins that can be dragged, not as small dots."""

    outcome: Outcome
    layer: Layer = "skin"
    is_before: bool = False
    has_pins: bool = False


class ReviewView:
    """The scene of one case for one clinician. Raises ValueError when nothing was scanned or there are no areas."""

    def __init__(
        self,
        server: viser.ViserServer,
        computed: Outcome,
        on_area: AreaMoved,
        on_landmark: LandmarkMoved,
        age_years: float | None = None,
        sides: Sides | None = None,
    ) -> None:
        if computed.scan is None or not computed.areas:
            raise ValueError("there is no result to review")
        self._server = server
        self._computed, self._scan = computed, computed.scan
        self._skin = SkinCaster(computed.scan.display)
        self._on_area, self._on_landmark = on_area, on_landmark
        self._chestpiece = chestpiece_mm(age_years)
        self._pin_mm = REVIEW_PIN * PIN_SHARE * trunk_mm(computed.scan, computed.landmarks)
        self._formers: set[AreaName] = set()
        self._pins: set[LandmarkName] = set()
        self._lock = threading.Lock()
        self._layers: dict[str, Any] = {"skin": show_body(server, computed.scan, computed.landmarks, sides)}
        self._layers |= _fit_layers(server.scene, computed)
        server.on_client_connect(self._frame)

    @property
    def layers(self) -> tuple[Layer, ...]:
        """What can be shown: a method without a fitted body has the skin alone."""
        return tuple(layer for layer in LAYERS if layer in self._layers)

    def show(self, shown: Shown) -> None:
        """Draw this and nothing else."""
        with self._lock:
            for name, mesh in self._layers.items():
                mesh.visible = name == shown.layer or (name == "skin" and shown.layer == "fitted")
            outcome = self._computed if shown.is_before else shown.outcome
            for name, area in outcome.areas.items():
                handles = show_area(self._server.scene, self._scan, name, area, self._chestpiece)
                for handle in () if shown.is_before else handles:
                    handle.on_drag("left")(partial(self._dragged, partial(self._on_area, name), area.position))
            self._show_formers(set() if shown.is_before else _moved(self._computed, outcome))
            self._show_landmarks(outcome.landmarks, shown.has_pins and not shown.is_before)

    def look_at(self, name: AreaName | None, outcome: Outcome) -> None:
        """Turn every window of this view to an area; to the whole chest when there is no name."""
        for client in self._server.get_clients().values():
            whole = framed(self._scan, self._computed.landmarks, client.camera.aspect)
            stand(client, whole if name is None else close_to(outcome.areas[name], whole))

    def _show_formers(self, wanted: set[AreaName]) -> None:
        for name in self._formers - wanted:
            self._server.scene.remove_by_name(f"/former/{name}")
        for name in wanted - self._formers:
            show_former(self._server.scene, self._scan, name, self._computed.areas[name], self._chestpiece)
        self._formers = wanted

    def _show_landmarks(self, landmarks: Landmarks, has_pins: bool) -> None:
        """Pins lie over areas, a nipple's over the mitral one: they are only there when somebody wants to move them."""
        known = {name: landmarks[name] for name in LANDMARK_NAMES if name in landmarks}
        if not has_pins:
            show_dots(self._server.scene, known)
            for name in self._pins:
                self._server.scene.remove_by_name(f"/pins/{name}")
            self._pins = set()
            return
        for name, pin in show_landmarks(self._server.scene, known, NUMBERS, self._pin_mm).items():
            for handle in pin:
                handle.on_drag("left")(partial(self._dragged, partial(self._on_landmark, name), known[name].position))
        self._pins = set(known)

    def _dragged(self, put: Callable[[np.ndarray], None], position: np.ndarray, event: Any) -> None:
        """position: (3,) where it stood."""
        place = dragged_to(self._skin, position, event)
        if place is not None:
            put(place)

    def _frame(self, client: viser.ClientHandle) -> None:
        stand(client, framed(self._scan, self._computed.landmarks, client.camera.aspect))


def misfit_colours(gaps_mm: np.ndarray) -> np.ndarray:
    """(n, 3) uint8 colours of gaps (n,) in mm between the skin and the fitted body."""
    channels = [np.interp(gaps_mm, MISFIT_MM, MISFIT_COLOURS[:, channel]) for channel in range(3)]
    return np.stack(channels, axis=1).round().astype(np.uint8)


def _fit_layers(scene: viser.SceneApi, computed: Outcome) -> dict[str, Any]:
    """The fitted body as a veil over the skin, and the skin coloured by the gap to it; neither without a fit."""
    if computed.fit is None or computed.scan is None:
        return {}
    body, skin = computed.fit.surface, computed.scan.display
    veil = scene.add_mesh_simple(
        "/fitted",
        body.vertices * VIEW,
        body.triangles,
        color=FITTED,
        opacity=0.45,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
        visible=False,
    )
    import trimesh  # takes long to load, and only a clinician looks at the misfit

    colours = misfit_colours(SkinCaster(body).distances(skin.vertices))
    painted = trimesh.Trimesh(skin.vertices * VIEW, skin.triangles, vertex_colors=colours, process=False)
    heat = scene.add_mesh_trimesh("/misfit", painted, visible=False, cast_shadow=False, receive_shadow=False)
    return {"fitted": veil, "misfit": heat}


def _moved(computed: Outcome, now: Outcome) -> set[AreaName]:
    return {
        name for name, area in now.areas.items() if not np.array_equal(area.position, computed.areas[name].position)
    }
