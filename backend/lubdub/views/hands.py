"""What a hand does in a live view, and where a window is made to stand."""

from __future__ import annotations

from typing import Any

import numpy as np
import viser

from lubdub.geometry.raycast import SkinCaster
from lubdub.views.framing import Camera
from lubdub.views.scene import VIEW


def dragged_to(skin: SkinCaster, position: np.ndarray, event: Any) -> np.ndarray | None:
    """(3,) on the skin, as far from position (3,) as something there was dragged, wherever it was held.

    None while the hand still holds it, and when it was dragged off the body.
    """
    if event.phase != "end":
        return None
    eye = np.asarray(event.client.camera.position) / VIEW
    end = position + (np.asarray(event.end_position) - np.asarray(event.start_position)) / VIEW
    return skin.hit(eye, end - eye)


def stand(client: viser.ClientHandle, camera: Camera) -> None:
    """Let a window look from there."""
    client.camera.position = camera.position * VIEW
    client.camera.look_at = camera.look_at * VIEW
