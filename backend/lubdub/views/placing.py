"""A live view in which one person marks points on the skin: by tapping, dragging or aiming a crosshair."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import viser

from lubdub.geometry.raycast import SkinCaster
from lubdub.results import LANDMARK_NAMES, CleanScan, Landmark, LandmarkName, Landmarks
from lubdub.views.export import dressed
from lubdub.views.framing import framed
from lubdub.views.scene import VIEW, show_body, show_landmarks, trunk_mm

Placed = Callable[[LandmarkName, np.ndarray], None]
"""Called with a landmark's name and its new place (3,), mm, body frame, on the shown skin."""

NUMBERS: dict[LandmarkName, int] = {name: number for number, name in enumerate(LANDMARK_NAMES, start=1)}
PIN_SHARE = 0.045
"""A pin's size as a share of the way from notch to navel: 10 mm on a young child, 17 mm on an adult."""


class NotOneViewer(Exception):
    """Aiming needs exactly one open view, or it is not known whose camera counts."""


class MissedTheBody(Exception):
    """The ray of sight meets no skin, or no point is waiting to be placed."""


class PlacingView:
    """The scene of one open case and the point that the next tap sets."""

    def __init__(self, server: viser.ViserServer, scan: CleanScan, landmarks: Landmarks, on_placed: Placed) -> None:
        self.target: LandmarkName | None = None
        self._server = server
        self._skin = SkinCaster(scan.display)
        self._on_placed = on_placed
        self._lock = threading.Lock()
        self._shown: dict[LandmarkName, Any] = {}
        self._pin_mm = PIN_SHARE * trunk_mm(scan, landmarks)
        skin = show_body(server, scan, landmarks)
        skin.on_click(self._tapped)
        self._frame_each_window(scan, landmarks)

    def show(self, landmarks: Mapping[LandmarkName, Landmark]) -> None:
        """Draw these pins and no others."""
        with self._lock:
            for name in set(self._shown) - set(landmarks):
                self._shown.pop(name).remove()
                self._server.scene.remove_by_name(f"/pins/{name}")
            balls = show_landmarks(self._server.scene, landmarks, NUMBERS, self._pin_mm)
            for name, ball in balls.items():
                ball.on_drag("left")(partial(self._dragged, name))
            self._shown = dict(balls)

    def place_at_crosshair(self) -> np.ndarray:
        """Put the target where the middle of the single open view points. Returns (3,).

        Raises NotOneViewer, MissedTheBody.
        """
        clients = list(self._server.get_clients().values())
        if len(clients) != 1:
            raise NotOneViewer
        camera = clients[0].camera
        forward = viser.transforms.SO3(camera.wxyz).as_matrix()[:, 2]
        return self._cast(np.asarray(camera.position) / VIEW, forward, self.target)

    def _tapped(self, event: Any) -> None:
        try:
            self._cast(np.asarray(event.ray_origin) / VIEW, np.asarray(event.ray_direction), self.target)
        except MissedTheBody:
            return  # viser saw the skin and our ray just passed its rim: nothing was marked, nothing changes

    def _dragged(self, name: LandmarkName, event: Any) -> None:
        if event.phase != "end":
            return
        eye = np.asarray(event.client.camera.position) / VIEW
        try:
            self._cast(eye, np.asarray(event.end_position) / VIEW - eye, name)
        except MissedTheBody:
            return  # dragged off the body: the pin stays where it was

    def _cast(self, origin: np.ndarray, direction: np.ndarray, name: LandmarkName | None) -> np.ndarray:
        if name is None:
            raise MissedTheBody
        place = self._skin.hit(origin, direction)
        if place is None:
            raise MissedTheBody
        self._on_placed(name, place)
        return place

    def _frame_each_window(self, scan: CleanScan, landmarks: Landmarks) -> None:
        @self._server.on_client_connect
        def _(client: viser.ClientHandle) -> None:
            camera = framed(scan, landmarks, client.camera.aspect)
            client.camera.position = camera.position * VIEW
            client.camera.look_at = camera.look_at * VIEW


def live_page() -> str:
    """viser's own page from the installed release, its panel hidden. The product serves it behind its own door."""
    built = Path(viser.__file__).parent / "client" / "build" / "index.html"
    return dressed(built.read_text(encoding="utf-8"))
