"""Drawing skin without a graphics card: parallel rays from the viewer, soft light, matt plaster."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.surface import Surface, unit


@dataclass(frozen=True)
class View:
    """Where the viewer stands: in front, head up, far away, perhaps stepped to the patient's left.

    centre: (3,) mm, what the middle of the picture looks at. width, height: pixels.
    turn_deg: how far the viewer has walked from the front towards the patient's left.
    """

    centre: np.ndarray
    mm_per_pixel: float
    width: int
    height: int
    turn_deg: float = 0.0

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) rows: to the right in the picture, up in it, and towards the viewer; body frame."""
        angle = np.deg2rad(self.turn_deg)
        towards = np.array([np.sin(angle), 0.0, np.cos(angle)])
        up = np.array([0.0, 1.0, 0.0])
        return np.stack([np.cross(up, towards), up, towards])

    def pixels_of(self, points: np.ndarray) -> np.ndarray:
        """(k, 2) where points (k, 3) appear: pixels to the right, and down, from the picture's upper left corner."""
        flat = (np.atleast_2d(points) - self.centre) @ self.axes[:2].T / self.mm_per_pixel
        return np.asarray(flat * [1, -1] + [self.width / 2, self.height / 2])

    def finer(self, times: int) -> View:
        """The same look with `times` as many pixels each way."""
        return View(self.centre, self.mm_per_pixel / times, self.width * times, self.height * times, self.turn_deg)


@dataclass(frozen=True)
class Seen:
    """What each pixel shows. met: (h, w) bool; points: (h, w, 3), NaN where nothing is.

    normals: (h', w', 3) units, zero where nothing is, and height: (h', w') mm towards the viewer, both for
    every `step`-th pixel only: light changes slowly, edges do not.
    """

    view: View
    met: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    height: np.ndarray
    step: int


@dataclass(frozen=True)
class Plaster:
    """How the skin is lit. Directions are towards each light, in the picture's axes (right, up, viewer)."""

    key: tuple[float, float, float] = (-0.55, 0.6, 0.75)
    fill: tuple[float, float, float] = (0.9, 0.05, 0.6)
    room: float = 0.34
    key_strength: float = 0.62
    fill_strength: float = 0.20
    smooth_mm: float = 3.8
    """Normals and heights are averaged over this far: a scan's noise is not the body's."""
    hollow_mm: float = 14.0
    """Places lower than their surroundings within this reach are darker, as in a room."""
    hollow_strength: float = 0.035
    """Darkening for each millimetre lower."""


def look(surface: Surface, view: View, step: int = 1) -> Seen:
    """Cast one ray for each pixel; find the normal for every `step`-th. surface: triangulated, mm."""
    right, up, towards = view.axes
    x = (np.arange(view.width) + 0.5 - view.width / 2) * view.mm_per_pixel
    y = (view.height / 2 - np.arange(view.height) - 0.5) * view.mm_per_pixel
    reach = float(np.abs(surface.vertices - view.centre).max()) * 2 + 1000
    origins = view.centre + reach * towards + x[None, :, None] * right + y[:, None, None] * up
    hits = SkinCaster(surface).cast(origins.reshape(-1, 3), -towards)
    shape = (view.height, view.width)
    met, points = hits.met.reshape(shape), hits.points.reshape(*shape, 3)
    some = (slice(None, None, step), slice(None, None, step))
    corners = surface.normals[surface.triangles[hits.triangle.reshape(shape)[some]]]
    normals = np.einsum("hwc,hwcd->hwd", hits.weights.reshape(*shape, 3)[some], corners)
    # A triangle wound the wrong way round is still skin: what is seen faces the viewer.
    normals[(normals @ towards) < 0] *= -1
    normals = np.where(met[some][..., None], unit(normals), 0)
    height = np.where(met[some], (points[some] - view.centre) @ towards, 0.0)
    return Seen(view, met, points, normals, height, step)


def brightness(seen: Seen, plaster: Plaster) -> np.ndarray:
    """(h, w) how bright each pixel of white plaster is, about 0.3 to 1.15."""
    pixel, met = seen.view.mm_per_pixel * seen.step, seen.met[:: seen.step, :: seen.step]
    blurred = mean_near(seen.normals, met, plaster.smooth_mm / pixel)
    normals = unit(blurred) @ seen.view.axes.T
    key, fill = unit(np.array(plaster.key)), unit(np.array(plaster.fill))
    lit = plaster.room * (0.75 + 0.25 * normals[..., 1])
    lit = lit + plaster.key_strength * np.clip((normals @ key + 0.25) / 1.25, 0, None)
    lit = lit + plaster.fill_strength * np.clip(normals @ fill, 0, None)
    around = mean_near(seen.height[..., None], met, plaster.hollow_mm / pixel)[..., 0]
    above = mean_near(seen.height[..., None], met, plaster.smooth_mm / pixel)[..., 0] - around
    lit = lit * np.clip(1 + plaster.hollow_strength * above, 0.7, 1.12)
    wide = lit.repeat(seen.step, axis=0).repeat(seen.step, axis=1)
    return np.asarray(wide[: seen.met.shape[0], : seen.met.shape[1]])


def mean_near(values: np.ndarray, met: np.ndarray, sigma: float) -> np.ndarray:
    """Mean of the pixels (h, w, c) that show something, weighted nearly as a Gaussian of sigma pixels would."""
    # Two passes of a box of this side have the Gaussian's variance, at a cost that does not grow with sigma.
    side = max(1, round(sigma * np.sqrt(6)))
    both = np.concatenate([values * met[..., None], met[..., None]], axis=2).astype(np.float32)
    for _ in range(2):
        both = uniform_filter(both, (side, side, 0), mode="constant")
    return np.asarray(both[..., :-1] / np.maximum(both[..., -1:], 1e-6))
