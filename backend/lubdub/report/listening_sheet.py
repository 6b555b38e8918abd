"""The sheet to print: the chest from the front in its true size, the four places on it, and how to find them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from fpdf.enums import Align
from PIL import Image

from lubdub.report.listening_words import ListeningFacts, ListeningWords
from lubdub.report.marks import STYLES
from lubdub.report.printing import INK, QUIET, TEAL, Colour, Sheet
from lubdub.report.render import Plaster, View, brightness, look
from lubdub.report.stationery import PAPERS, Paper
from lubdub.results import Area, AreaName, CleanScan, Outcome

EDGE = 12.0
PICTURE_TOP = 44.0
UNDER_PICTURE = {"a4": 100.0, "letter": 98.0}
"""Room for the words under the picture, mm."""
ABOVE_NOTCH_MM = 16.0
AROUND_MM = 6.0
"""Free space between the outermost ring and the picture's edge."""
SCALES = (1.0, 0.95, 0.9, 0.8, 0.75, 0.66, 0.5, 0.4, 0.33, 0.25)
PIXELS_PER_MM = 3.0
BAR_MM, CARD_MM = 50.0, 85.6
"""A bank card is 85.60 mm long (ISO/IEC 7810 ID-1): many have one at hand, few a ruler."""
BADGE_MM = 7.0
POINTS = (9.5, 9.0, 8.5, 8.0, 7.5, 7.0)
"""Sizes of the words under the picture: the largest at which a language's sentences fit on the page."""
FOOT_MM = 8.0
STOP: Colour = (168, 56, 34)


@dataclass(frozen=True)
class Window:
    """What part of the body is drawn where. left, top, width, height: mm of paper; middle: (2,) mm of the body in the
    picture's middle; scale: paper over body."""

    left: float
    top: float
    width: float
    height: float
    middle: np.ndarray
    scale: float

    def at(self, point: np.ndarray) -> tuple[float, float]:
        """Where a point of the body (3,) stands on the paper, seen from the front."""
        x, y = (np.asarray(point)[:2] - self.middle) * self.scale
        return float(self.left + self.width / 2 + x), float(self.top + self.height / 2 - y)


def listening_sheet(
    outcome: Outcome, facts: ListeningFacts, words: ListeningWords, paper: Paper = "a4", language: str = "en"
) -> bytes:
    """One page of PDF. Raises ValueError without areas, FontMissing when the language's letters are not installed."""
    if outcome.scan is None or not outcome.areas:
        raise ValueError("there are no places to print")
    window = window_for(outcome, facts.chestpiece_mm, paper)
    plaster = None if outcome.scan.display.is_cloud else _plaster(outcome.scan, window)
    for points in POINTS:
        sheet = Sheet(paper, words.title, language, _all_words(facts, words))
        sheet.words(10.0, words.title, 18, "B", TEAL, EDGE, sheet.w - 2 * EDGE)
        sheet.words(18.5, f"{facts.whose}  {facts.made_on}", 10, "", INK, EDGE, sheet.w - 2 * EDGE)
        _check_lines(sheet, words)
        if plaster is not None:
            sheet.image(plaster, window.left, window.top, window.width, window.height)
        _marks(sheet, outcome, facts, words, window)
        if _under(sheet, facts, words, window, points) <= sheet.h - FOOT_MM:
            break
    return bytes(sheet.output())


def _all_words(facts: ListeningFacts, words: ListeningWords) -> str:
    said = [words.all(), facts.whose, facts.made_on, facts.posture, facts.care]
    return " ".join(said + [f"{place.title} {place.instruction} {place.sureness}" for place in facts.places])


def window_for(outcome: Outcome, chestpiece_mm: float, paper: Paper) -> Window:
    """The largest scale, true size if it may be, at which all four rings and both ends of the breastbone fit."""
    page_width, page_height = PAPERS[paper]
    width, height = page_width - 2 * EDGE, page_height - PICTURE_TOP - UNDER_PICTURE[paper]
    notch = outcome.landmarks["suprasternal_notch"].position[:2] if _has_notch(outcome) else np.zeros(2)
    reach = np.array([max(chestpiece_mm / 2, area.radius_mm) + AROUND_MM for area in outcome.areas.values()])
    spots = np.array([area.position[:2] for area in outcome.areas.values()])
    lowest = float((spots[:, 1] - reach).min())
    aside = float((np.abs(spots[:, 0] - notch[0]) + reach).max())
    top = float(notch[1]) + ABOVE_NOTCH_MM
    scale = next((one for one in SCALES if (top - lowest) * one <= height and 2 * aside * one <= width), SCALES[-1])
    return Window(EDGE, PICTURE_TOP, width, height, np.array([notch[0], top - height / scale / 2]), scale)


def _has_notch(outcome: Outcome) -> bool:
    return "suprasternal_notch" in outcome.landmarks


def _check_lines(sheet: Sheet, words: ListeningWords) -> None:
    sheet.words(25.0, words.check, 9, "", INK, EDGE, sheet.w - 2 * EDGE)
    for left, length, label in ((EDGE, BAR_MM, words.five_cm), (EDGE + 68, CARD_MM, words.card)):
        sheet.bar(left, 34.0, length)
        sheet.words(36.6, label, 8, "", QUIET, left, length, Align.C)


def _marks(sheet: Sheet, outcome: Outcome, facts: ListeningFacts, words: ListeningWords, window: Window) -> None:
    with sheet.rect_clip(window.left, window.top, window.width, window.height):
        _breastbone(sheet, outcome, words, window)
        for name, area in outcome.areas.items():
            _rings(sheet, name, area, facts.chestpiece_mm, window)
        for name, area in outcome.areas.items():
            _badge(sheet, name, *window.at(area.position))
    sheet.pen(QUIET, 0.2)
    sheet.rect(window.left, window.top, window.width, window.height)
    foot = window.top + window.height - 6.0
    for text, align in ((words.right, Align.L), (words.left, Align.R)):
        sheet.words(foot, text, 10, "B", INK, window.left + 3, window.width - 6, align)


def _plaster(scan: CleanScan, window: Window) -> Image.Image:
    """The skin as pale plaster on white, with no more contrast than a printer needs."""
    size = round(window.width * PIXELS_PER_MM), round(window.height * PIXELS_PER_MM)
    depth = float(scan.display.vertices[:, 2].max())
    view = View(np.array([*window.middle, depth]), 1 / PIXELS_PER_MM / window.scale, *size)
    seen = look(scan.display, view, step=2)
    shade = np.clip(150 + 95 * brightness(seen, Plaster()), 0, 240)
    return Image.fromarray(np.where(seen.met, shade, 255).astype(np.uint8))


def _breastbone(sheet: Sheet, outcome: Outcome, words: ListeningWords, window: Window) -> None:
    ends = [("suprasternal_notch", words.top_of_bone, -4.6), ("xiphisternum", words.end_of_bone, 1.6)]
    places = [outcome.landmarks[name].position for name, *_ in ends if name in outcome.landmarks]  # type: ignore[index]
    if len(places) == 2:
        sheet.pen(QUIET, 0.25)
        sheet.set_dash_pattern(dash=1.5, gap=1.5)
        sheet.line(*window.at(places[0]), *window.at(places[1]))
        sheet.set_dash_pattern()
    for name, label, below in ends:
        if name in outcome.landmarks:
            x, y = window.at(outcome.landmarks[name].position)  # type: ignore[index]
            sheet.pen(INK, 0.5)
            sheet.line(x - 3, y, x + 3, y)
            sheet.line(x, y - 3, x, y + 3)
            sheet.words(y + below, label, 8, "", INK, x - 64, 60, Align.R)


def _rings(sheet: Sheet, name: AreaName, area: Area, chestpiece_mm: float, window: Window) -> None:
    x, y = window.at(area.position)
    sheet.pen(STYLES[name].colour, 0.35)
    sheet.set_dash_pattern(dash=1.2, gap=1.2)
    sheet.circle(x, y, area.radius_mm * window.scale)
    sheet.set_dash_pattern()
    sheet.pen(INK, 1.3)
    sheet.circle(x, y, chestpiece_mm / 2 * window.scale)
    sheet.pen(STYLES[name].colour, 0.8)
    sheet.circle(x, y, chestpiece_mm / 2 * window.scale)


def _badge(sheet: Sheet, name: AreaName, x: float, y: float) -> None:
    style, half = STYLES[name], BADGE_MM / 2
    sheet.pen(INK, 0.25)
    sheet.set_fill_color(*style.colour)
    if name == "aortic":
        sheet.circle(x, y, half, style="FD")
    elif name == "pulmonary":
        sheet.rect(x - half, y - half, BADGE_MM, BADGE_MM, style="FD", round_corners=True, corner_radius=1.5)
    elif name == "tricuspid":
        sheet.polygon([(x, y - 1.2 * half), (x + 1.25 * half, y + half), (x - 1.25 * half, y + half)], style="FD")
    else:
        sheet.polygon([(x, y - 1.3 * half), (x + 1.3 * half, y), (x, y + 1.3 * half), (x - 1.3 * half, y)], style="FD")
    lower = 0.9 if name == "tricuspid" else 0.0
    text = f"{style.number}{style.letter}"
    sheet.words(y - 1.65 + lower, text, 8, "B", style.ink, x - half, BADGE_MM, Align.C)


def _under(sheet: Sheet, facts: ListeningFacts, words: ListeningWords, window: Window, points: float) -> float:
    """All words under the picture. Returns where they end, mm."""
    width, line = sheet.w - 2 * EDGE, 0.45 * points + 0.3
    size = words.true_size if window.scale == 1.0 else words.scaled.format(scale=round(100 * window.scale))
    ring = words.ring.format(diameter=round(facts.chestpiece_mm))
    top = window.top + window.height + 2.0
    top = sheet.words(top, f"{size} {ring} {words.flat}", points - 1, "", QUIET, EDGE, width) + 1.2
    if facts.care:
        top = sheet.words(top, facts.care, points, "B", STOP, EDGE, width) + 1.2
    for place in facts.places:
        _badge(sheet, place.name, EDGE + 4.5, top + 4.6)
        head = f"{STYLES[place.name].number}. {place.title} · {place.sureness}"
        sheet.words(top, head, points, "B", INK, EDGE + 12, width - 12)
        end = sheet.words(top + line, place.instruction, points, "", INK, EDGE + 12, width - 12)
        top = max(end, top + BADGE_MM + 1.5) + 1.5
    top = sheet.words(top, facts.posture, points, "", INK, EDGE, width) + 0.8
    return sheet.words(top, words.not_diagnosis, points, "B", INK, EDGE, width)
