"""One still picture of a result, drawn on the server: the areas on the skin, and the fitted body beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from lubdub.geometry.surface import Surface
from lubdub.report.lettering import Page
from lubdub.report.marks import INK, STYLES, WHITE, Colour, paint_area
from lubdub.report.render import Plaster, Seen, View, brightness, look
from lubdub.results import CleanScan, Fit, Outcome, VerdictWord

PAPER: Colour = (251, 248, 243)
SKIN: Colour = (214, 199, 184)
TEAL: Colour = (70, 160, 156)
ACCENT: Colour = (200, 69, 47)
QUIET: Colour = (92, 101, 104)
FINER = 2
"""Everything is drawn with this many times the pixels each way and shrunk, so that edges are smooth."""

HEADLINES: dict[VerdictWord, str] = {
    "show": "Where to listen",
    "show_with_care": "Where to listen: ask your clinician first",
    "refuse": "We cannot show the four places on this scan",
}


@dataclass(frozen=True)
class Framing:
    """What part of the body is shown: collarbones to navel."""

    above_notch: float = 0.14
    """Of the trunk (notch to navel), shown above the notch."""
    below_navel: float = 0.12
    margin: float = 1.06
    widest: tuple[float, float] = (5.0, 95.0)
    """Percentiles of the skin that must fit in from side to side: arms may be cut off, the chest not."""
    side_turn_deg: float = 32.0
    """The second look is from the patient's left: two surfaces over each other show nothing from the front."""
    shape_share: float = 0.048
    """Radius of an area's shape, of the trunk: 18 mm on an adult, near a chestpiece at any age."""


FRAMING = Framing()


def draw(outcome: Outcome, size: tuple[int, int] = (1200, 900)) -> bytes:
    """A PNG of the result, `size` pixels wide and high.

    Left: the scan with the four areas and the landmarks. Right: the fitted body over the scan, when there is
    one. A refused outcome shows the scan without areas, and its reasons in words.
    """
    page = Page(size, PAPER)
    page.headline(HEADLINES[outcome.verdict], ACCENT if outcome.verdict == "refuse" else INK)
    left, right = page.panels(two=outcome.fit is not None or outcome.verdict == "refuse")
    if outcome.scan is not None:
        trunk = trunk_mm(outcome)
        view = framed(outcome.scan, trunk, left.width, left.height)
        page.paste(_chest(outcome, view, trunk), left)
        page.sides(left)
        page.caption("The scan, seen from the front", left)
    if outcome.verdict == "refuse":
        page.words([(r.message, r.advice) for r in outcome.reasons], right or left, ACCENT)
    else:
        if outcome.fit is not None and outcome.scan is not None and right is not None:
            turned = framed(outcome.scan, trunk_mm(outcome), right.width, right.height, FRAMING.side_turn_deg)
            page.paste(_overlay(outcome.scan, outcome.fit, turned), right)
            page.caption("A reference body (teal) bent onto it, seen from the patient's left", right)
        page.legend({STYLES[name]: area.radius_mm for name, area in outcome.areas.items()})
        page.footer([r.message for r in outcome.reasons])
    return page.png()


def trunk_mm(outcome: Outcome) -> float:
    """From the notch to the navel; guessed from the scan when nobody marked the navel."""
    if "navel" in outcome.landmarks:
        return abs(float(outcome.landmarks["navel"].position[1]))
    if outcome.scan is None:
        return 360.0
    return max(100.0, 0.85 * -float(np.percentile(outcome.scan.points[:, 1], 2)))


def framed(scan: CleanScan, trunk: float, width: int, height: int, turn_deg: float = 0.0) -> View:
    """The look that shows the chest from collarbones to navel in width x height pixels."""
    points = scan.display.vertices
    lowest, highest = np.percentile(points[:, 1], [0.5, 99.5])
    top = min(highest, FRAMING.above_notch * trunk)
    bottom = max(lowest, -(1 + FRAMING.below_navel) * trunk)
    shown = points[(points[:, 1] >= bottom) & (points[:, 1] <= top)]
    shown = shown if len(shown) else points
    probe = View(np.zeros(3), 1.0, width, height, turn_deg)
    across = shown @ probe.axes[0]
    low, high = np.percentile(across, FRAMING.widest)
    scale = FRAMING.margin * max((top - bottom) / height, (high - low) / width)
    centre = (low + high) / 2 * probe.axes[0] + np.array([0.0, (top + bottom) / 2, 0.0])
    return View(centre, float(scale), width, height, turn_deg)


def skin(surface: Surface, view: View, colour: Colour = SKIN) -> tuple[np.ndarray, Seen]:
    """(h, w, 3) of 0..255, a surface as plaster on paper; and what was seen, at the same size."""
    seen = look(surface, view, step=FINER)
    shade = brightness(seen, Plaster())[..., None]
    lit = np.clip(shade * np.array(colour, np.float64), 0, 255)
    return np.where(seen.met[..., None], lit, np.array(PAPER, np.float64)), seen


def _chest(outcome: Outcome, view: View, trunk: float) -> Image.Image:
    if outcome.scan is None or outcome.scan.display.is_cloud:
        return Image.new("RGB", (view.width, view.height), PAPER)
    picture, seen = skin(outcome.scan.display, view.finer(FINER))
    shape_mm = FRAMING.shape_share * trunk
    for name, area in outcome.areas.items():
        paint_area(picture, seen, area, STYLES[name], shape_mm)
    image = _small(picture, view)
    pen = ImageDraw.Draw(image)
    for landmark in outcome.landmarks.values():
        _dot(pen, view.pixels_of(landmark.position)[0], hollow=not landmark.is_marked)
    for name, area in outcome.areas.items():
        Page.letter(image, STYLES[name], view.pixels_of(area.position)[0], shape_mm / view.mm_per_pixel)
    return image


def _overlay(scan: CleanScan, fit: Fit, view: View) -> Image.Image:
    """The scan as plaster and the fitted body over it, as tinted glass."""
    if scan.display.is_cloud:
        picture = np.full((view.height * FINER, view.width * FINER, 3), PAPER, np.float64)
    else:
        picture, _ = skin(scan.display, view.finer(FINER))
    glass, seen = skin(fit.surface, view.finer(FINER), TEAL)
    cover = 0.55 * seen.met[..., None]
    image = _small(picture * (1 - cover) + glass * cover, view)
    pen = ImageDraw.Draw(image)
    for name, place in fit.areas.items():
        x, y = view.pixels_of(place)[0]
        pen.ellipse((x - 5, y - 5, x + 5, y + 5), fill=STYLES[name].colour, outline=WHITE, width=2)
    return image


def _small(picture: np.ndarray, view: View) -> Image.Image:
    large = Image.fromarray(np.clip(picture, 0, 255).astype(np.uint8))
    return large.resize((view.width, view.height), Image.Resampling.BOX)


def _dot(pen: ImageDraw.ImageDraw, at: np.ndarray, hollow: bool) -> None:
    """A landmark; one that was only suggested is hollow."""
    x, y = at
    pen.ellipse((x - 4.5, y - 4.5, x + 4.5, y + 4.5), fill=WHITE)
    pen.ellipse((x - 3, y - 3, x + 3, y + 3), fill=WHITE if hollow else INK, outline=INK, width=1)


__all__ = ["FRAMING", "draw", "framed", "skin", "trunk_mm"]
