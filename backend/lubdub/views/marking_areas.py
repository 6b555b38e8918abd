"""A live view in which a clinician marks the four areas on a reference body, with no other marks in sight."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import viser

from lubdub.geometry.raycast import SkinCaster
from lubdub.results import Area, AreaName, CleanScan, Landmarks
from lubdub.views.framing import framed
from lubdub.views.hands import dragged_to, stand
from lubdub.views.scene import VIEW, Sides, chestpiece_mm, show_area, show_body, show_dots

Placed = Callable[[AreaName, np.ndarray], None]
"""Called with an area and its new place (3,), mm, the body's frame, on the skin."""
PARTS = ("region", "edge", "ring", "letter")


class AreaMarkingView:
    """The scene of one body for one clinician. in_hand: the area that the next tap on the skin puts there."""

    def __init__(
        self,
        server: viser.ViserServer,
        body: CleanScan,
        landmarks: Landmarks,
        on_placed: Placed,
        age_years: float | None = None,
        sides: Sides | None = None,
    ) -> None:
        self.in_hand: AreaName | None = None
        self._server, self._body, self._landmarks = server, body, landmarks
        self._skin = SkinCaster(body.display)
        self._on_placed = on_placed
        self._chestpiece = chestpiece_mm(age_years)
        self._shown: set[AreaName] = set()
        self._lock = threading.Lock()
        show_body(server, body, landmarks, sides).on_click(self._tapped)
        show_dots(server.scene, landmarks)
        server.on_client_connect(self._frame)

    def show(self, areas: Mapping[AreaName, Area]) -> None:
        """Draw these areas and no others."""
        with self._lock:
            for name in self._shown - set(areas):
                for part in PARTS:
                    self._server.scene.remove_by_name(f"/areas/{name}/{part}")
            for name, area in areas.items():
                for handle in show_area(self._server.scene, self._body, name, area, self._chestpiece):
                    handle.on_click(self._tapped)  # an area must not keep taps from the skin under it
                    handle.on_drag("left")(partial(self._dragged, name, area.position))
            self._shown = set(areas)

    def look_at_all(self) -> None:
        """Turn every window to the whole chest."""
        for client in self._server.get_clients().values():
            self._frame(client)

    def _tapped(self, event: Any) -> None:
        place = self._skin.hit(np.asarray(event.ray_origin) / VIEW, np.asarray(event.ray_direction))
        if place is not None and self.in_hand is not None:
            self._on_placed(self.in_hand, place)

    def _dragged(self, name: AreaName, position: np.ndarray, event: Any) -> None:
        place = dragged_to(self._skin, position, event)
        if place is not None:
            self._on_placed(name, place)

    def _frame(self, client: viser.ClientHandle) -> None:
        stand(client, framed(self._body, self._landmarks, client.camera.aspect))
