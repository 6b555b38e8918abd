"""The flat badges that lie on the skin: a shape, a number or letter, and words that name a side.

The four areas are told apart by letter, shape and place before colour; the colours are from Okabe and Ito's
set for all kinds of colour vision, each with the ink that reads on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lubdub.results import AreaName

Shape = Literal["circle", "square", "triangle", "diamond"]
Colour = tuple[int, int, int]

INK: Colour = (31, 42, 46)
WHITE: Colour = (255, 255, 255)
TEAL: Colour = (11, 110, 110)
PIXELS = 192
OVERSAMPLE = 2
"""Drawn twice as large and shrunk, so that edges are smooth."""


@dataclass(frozen=True)
class AreaStyle:
    """How one area looks everywhere: on the body, in the table, in the list."""

    number: int
    letter: str
    shape: Shape
    colour: Colour
    ink: Colour


AREA_STYLES: dict[AreaName, AreaStyle] = {
    "aortic": AreaStyle(1, "A", "circle", (0, 114, 178), WHITE),
    "pulmonary": AreaStyle(2, "P", "square", (240, 176, 32), INK),
    "tricuspid": AreaStyle(3, "T", "triangle", (0, 158, 115), INK),
    "mitral": AreaStyle(4, "M", "diamond", (204, 121, 167), INK),
}

OUTLINES: dict[Shape, list[tuple[float, float]]] = {
    "triangle": [(0.5, 0.03), (0.97, 0.9), (0.03, 0.9)],
    "diamond": [(0.5, 0.02), (0.98, 0.5), (0.5, 0.98), (0.02, 0.5)],
}
LETTER_CENTRE: dict[Shape, tuple[float, float]] = {
    "circle": (0.5, 0.5),
    "square": (0.5, 0.5),
    "triangle": (0.5, 0.62),
    "diamond": (0.5, 0.5),
}
LETTER_SIZE: dict[Shape, float] = {"circle": 0.6, "square": 0.64, "triangle": 0.5, "diamond": 0.52}


def badge(shape: Shape, text: str, colour: Colour, ink: Colour) -> np.ndarray:
    """(PIXELS, PIXELS, 4) uint8: a filled shape with a white rim and one character upright on it."""
    size = PIXELS * OVERSAMPLE
    picture = Image.new("RGBA", (size, size), (*colour, 0))
    draw = ImageDraw.Draw(picture)
    for inset, fill in ((0.0, INK), (0.02, WHITE), (0.075, colour)):
        _fill(draw, shape, size, inset, fill)
    x, y = LETTER_CENTRE[shape]
    font = ImageFont.load_default(size * LETTER_SIZE[shape] / max(1.0, 0.75 * len(text)))
    draw.text((x * size, y * size), text, font=font, fill=ink, anchor="mm", stroke_width=size * 0.012, stroke_fill=ink)
    return np.asarray(picture.resize((PIXELS, PIXELS), Image.Resampling.LANCZOS))


def plate(text: str, letters: Path | None = None, colour: Colour = INK, ink: Colour = WHITE) -> np.ndarray:
    """(h, w, 4) uint8: a rounded plate of words as wide as they need; `\\n` makes two lines.

    letters: a TrueType file with the text's letters; without, those of European languages.
    """
    font = ImageFont.load_default(64) if letters is None else ImageFont.truetype(letters, 64)
    probe = ImageDraw.Draw(Image.new("RGBA", (1, 1)))
    left, top, right, bottom = probe.multiline_textbbox((0, 0), text, font=font, align="center", spacing=12)
    width, height = int(right - left) + 72, int(bottom - top) + 56
    picture = Image.new("RGBA", (width, height), (*colour, 0))
    draw = ImageDraw.Draw(picture)
    draw.rounded_rectangle((0, 0, width - 1, height - 1), radius=28, fill=(*colour, 255))
    draw.multiline_text(
        (36 - left, 28 - top), text, font=font, fill=ink, align="center", spacing=12, stroke_width=1, stroke_fill=ink
    )
    return np.asarray(picture)


def _fill(draw: ImageDraw.ImageDraw, shape: Shape, size: int, inset: float, fill: Colour) -> None:
    low, high = inset * size, (1 - inset) * size - 1
    paint = (*fill, 255)
    if shape == "circle":
        draw.ellipse((low, low, high, high), fill=paint)
    elif shape == "square":
        draw.rounded_rectangle((low, low, high, high), radius=0.2 * size, fill=paint)
    else:
        # Scaled about the outline's own middle, so that the rim is even on a triangle too.
        corners = np.array(OUTLINES[shape])
        middle = corners.mean(axis=0)
        points = (middle + (corners - middle) * (1 - 2.4 * inset)) * size
        draw.polygon([(float(x), float(y)) for x, y in points], fill=paint)
