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
from lubdub.views.export import dressed, scripted
from lubdub.views.framing import framed
from lubdub.views.scene import VIEW, Sides, show_body, show_landmarks, show_skin, trunk_mm

Placed = Callable[[LandmarkName, np.ndarray], None]
"""Called with a landmark's name and its new place (3,), mm, body frame, on the shown skin."""

NUMBERS: dict[LandmarkName, int] = {name: number for number, name in enumerate(LANDMARK_NAMES, start=1)}
STEP_SHARE = 0.02
"""How far one press of an arrow key moves the crosshair, as a share of the same: 4 mm on a child, 8 on an adult."""
PIN_SHARE = 0.045
"""A pin's size as a share of the way from notch to navel: 10 mm on a young child, 17 mm on an adult."""


class NotOneViewer(Exception):
    """Aiming needs exactly one open view, or it is not known whose camera counts."""


class MissedTheBody(Exception):
    """The ray of sight meets no skin, or no point is waiting to be placed."""


class PlacingView:
    """The scene of one open case and the point that the next tap sets."""

    def __init__(
        self,
        server: viser.ViserServer,
        scan: CleanScan,
        landmarks: Landmarks,
        on_placed: Placed,
        sides: Sides | None = None,
    ) -> None:
        self.target: LandmarkName | None = None
        self._server = server
        self._landmarks = landmarks
        self._scan = scan
        self._skin = SkinCaster(scan.display)
        self._on_placed = on_placed
        self._lock = threading.Lock()
        self._shown: dict[LandmarkName, tuple[Any, ...]] = {}
        self._pin_mm = PIN_SHARE * trunk_mm(scan, landmarks)
        show_body(server, scan, landmarks, sides).on_click(self._tapped)
        server.on_client_connect(self._frame)

    @property
    def scan(self) -> CleanScan:
        """As it is shown now."""
        return self._scan

    def turn_to(self, scan: CleanScan) -> None:
        """Show the same scan lying another way; every window looks at it from the front again."""
        self._scan, self._skin = scan, SkinCaster(scan.display)
        show_skin(self._server.scene, scan).on_click(self._tapped)
        for client in self._server.get_clients().values():
            self._frame(client)

    def show(self, landmarks: Mapping[LandmarkName, Landmark]) -> None:
        """Draw these pins and no others."""
        with self._lock:
            for name in set(self._shown) - set(landmarks):
                for part in self._shown.pop(name):
                    part.remove()
            pins = show_landmarks(self._server.scene, landmarks, NUMBERS, self._pin_mm)
            for name, parts in pins.items():
                for part in parts:
                    part.on_click(self._tapped)  # a pin must not keep taps from the skin under it
                    part.on_drag("left")(partial(self._dragged, name, landmarks[name].position))
            self._shown = dict(pins)

    def place_at_crosshair(self) -> np.ndarray:
        """Put the target where the middle of the single open view points. Returns (3,).

        Raises NotOneViewer, MissedTheBody.
        """
        camera = self._only_window().camera
        forward = viser.transforms.SO3(camera.wxyz).as_matrix()[:, 2]
        return self._cast(np.asarray(camera.position) / VIEW, forward, self.target)

    def slide(self, right: float, up: float) -> None:
        """Move what the middle of the single open view points at, in steps of `STEP_SHARE`.

        Raises NotOneViewer.
        """
        camera = self._only_window().camera
        axes = viser.transforms.SO3(camera.wxyz).as_matrix()
        step = STEP_SHARE * trunk_mm(self._scan, self._landmarks) * VIEW
        camera.position = np.asarray(camera.position) + step * (right * axes[:, 0] - up * axes[:, 1])

    def _only_window(self) -> Any:
        windows = list(self._server.get_clients().values())
        if len(windows) != 1:
            raise NotOneViewer
        return windows[0]

    def _tapped(self, event: Any) -> None:
        try:
            self._cast(np.asarray(event.ray_origin) / VIEW, np.asarray(event.ray_direction), self.target)
        except MissedTheBody:
            return  # viser saw the skin and our ray just passed its rim: nothing was marked, nothing changes

    def _dragged(self, name: LandmarkName, position: np.ndarray, event: Any) -> None:
        """The pin goes as far as it was dragged, wherever it was held. position: (3,) where it stood."""
        if event.phase != "end":
            return
        eye = np.asarray(event.client.camera.position) / VIEW
        end = position + (np.asarray(event.end_position) - np.asarray(event.start_position)) / VIEW
        try:
            self._cast(eye, end - eye, name)
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

    def _frame(self, client: viser.ClientHandle) -> None:
        camera = framed(self._scan, self._landmarks, client.camera.aspect)
        client.camera.position = camera.position * VIEW
        client.camera.look_at = camera.look_at * VIEW


def live_page() -> str:
    """viser's own page from the installed release, its panel and its edge around what the pointer touches hidden.

    The product serves it behind its own door.
    """
    built = Path(viser.__file__).parent / "client" / "build" / "index.html"
    return scripted(dressed(built.read_text(encoding="utf-8")), "hovering.js")
