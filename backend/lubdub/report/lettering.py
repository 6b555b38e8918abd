"""The page around the drawn bodies: headline, panels, sides, legend, reasons."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lubdub.report.marks import INK, WHITE, AreaStyle, Colour

QUIET: Colour = (92, 101, 104)
LINE: Colour = (217, 211, 200)
PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "...", "\u00a0": " "})
"""The typeface that comes with Pillow has no typographic quotes and dashes."""


@dataclass(frozen=True)
class Panel:
    """A rectangle of the page, pixels."""

    x: int
    y: int
    width: int
    height: int


class Page:
    """A picture being laid out. All sizes follow the page's width, drawn for 1200 pixels."""

    def __init__(self, size: tuple[int, int], paper: Colour) -> None:
        self._image = Image.new("RGB", size, paper)
        self._pen = ImageDraw.Draw(self._image)
        self._unit = size[0] / 1200

    def png(self) -> bytes:
        """The page as a PNG file, with nothing else in it."""
        out = io.BytesIO()
        self._image.save(out, "PNG")
        return out.getvalue()

    def panels(self, two: bool) -> tuple[Panel, Panel | None]:
        """Where bodies are drawn: two panels side by side, or one."""
        edge, top, bottom = self._px(28), self._px(84), self._px(176)
        width, height = self._image.width - 2 * edge, self._image.height - top - bottom
        if not two:
            return Panel(edge, top, width, height), None
        gap = self._px(24)
        half = (width - gap) // 2
        return Panel(edge, top, half, height), Panel(edge + half + gap, top, half, height)

    def paste(self, picture: Image.Image, panel: Panel) -> None:
        """Put a drawn body into its panel."""
        self._image.paste(picture, (panel.x, panel.y))

    def headline(self, text: str, colour: Colour) -> None:
        """One line at the top."""
        self._text((self._px(28), self._px(26)), text, 34, colour, bold=True)

    def sides(self, panel: Panel) -> None:
        """Whose left is left. The patient's left is on the right: the patient faces the viewer."""
        y = panel.y + panel.height - self._px(30)
        self._plate("patient's right", panel.x + self._px(4), y, anchor="l")
        self._plate("patient's left", panel.x + panel.width - self._px(4), y, anchor="r")

    def caption(self, text: str, panel: Panel) -> None:
        """What a panel shows, under it."""
        x, y = panel.x + panel.width / 2, panel.y + panel.height + self._px(16)
        self._text((x, y), text, 17, QUIET, anchor="mm")

    def legend(self, radius_mm: Mapping[AreaStyle, float]) -> None:
        """The areas by shape, number, letter and name, in listening order, with the size of their regions."""
        step = (self._image.width - 2 * self._px(28)) / 4
        y = self._image.height - self._px(104)
        for style in sorted(radius_mm, key=lambda s: s.number):
            x = self._px(28) + (style.number - 1) * step
            self._image.paste(*self._icon(style, x, y))
            self._text(
                (x + self._px(64), y - self._px(25)), f"{style.number}  {style.word} ({style.letter})", 23, INK, True
            )
            within = f"9 times in 10 within {radius_mm[style] / 10:.1f} cm"
            self._text((x + self._px(64), y + self._px(4)), within, 17, QUIET)

    def footer(self, messages: Sequence[str]) -> None:
        """What to keep in mind: the reasons for care, else that this is an aid."""
        text = "  ".join(messages) or "A guide to where to listen. It is not a diagnosis."
        for row, line in enumerate(textwrap.wrap(text.translate(PLAIN), 128)[:2]):
            y = self._image.height - self._px(52) + row * self._px(22)
            self._text((self._px(28), y), line, 18, INK if messages else QUIET)

    def words(self, reasons: Sequence[tuple[str, str]], panel: Panel, accent: Colour) -> None:
        """Why nothing is shown and what to do, in a panel."""
        x, y = panel.x + self._px(24), float(panel.y + self._px(12))
        top = y
        for message, advice in reasons:
            for text, size, bold in ((message, 24, True), (advice, 21, False)):
                for line in textwrap.wrap(text.translate(PLAIN), int(0.88 * panel.width / self._px(size) * 2.05)):
                    self._text((x, y), line, size, INK, bold)
                    y += self._px(size * 1.45)
                y += self._px(8)
            y += self._px(20)
        self._pen.rectangle((panel.x, top, panel.x + self._px(5), max(top, y - self._px(28))), fill=accent)

    @staticmethod
    def letter(image: Image.Image, style: AreaStyle, at: np.ndarray, radius: float) -> None:
        """The letter upright in its shape and the number beside it. at: (2,) pixels; radius: of the shape, pixels."""
        pen = ImageDraw.Draw(image)
        x, y = float(at[0]), float(at[1])
        font = ImageFont.load_default(max(9.0, radius * 1.05))
        pen.text((x, y), style.letter, font=font, fill=INK, anchor="mm", stroke_width=max(1, round(radius / 18)))
        side, small = max(7.0, 0.42 * radius), 1.05 * radius
        x, y = x + small, y - small
        pen.ellipse((x - side - 1.5, y - side - 1.5, x + side + 1.5, y + side + 1.5), fill=WHITE)
        pen.ellipse((x - side, y - side, x + side, y + side), fill=style.colour)
        pen.text((x, y), str(style.number), font=ImageFont.load_default(1.45 * side), fill=style.ink, anchor="mm")

    def _icon(self, style: AreaStyle, x: float, y: float) -> tuple[Image.Image, tuple[int, int], Image.Image]:
        """The area's shape filled with its colour and letter, where it goes, and its mask."""
        size = self._px(52)
        at = (np.arange(size * 4) + 0.5 - size * 2) / (size * 2) * 1.3
        inside = style.outline(at[None, :], -at[:, None]) < 0
        mask = Image.fromarray(np.uint8(255) * inside.astype(np.uint8)).resize((size, size), Image.Resampling.BOX)
        icon = Image.new("RGB", (size, size), style.colour)
        font = ImageFont.load_default(size * 0.42)
        ImageDraw.Draw(icon).text((size / 2, size * 0.52), style.letter, font=font, fill=style.ink, anchor="mm")
        return icon, (round(x), round(y - size / 2)), mask

    def _plate(self, text: str, x: float, y: float, anchor: str) -> None:
        font = ImageFont.load_default(self._px(19))
        width, high = font.getlength(text) + self._px(24), self._px(32)
        left = x if anchor == "l" else x - width
        self._pen.rounded_rectangle((left, y - high / 2, left + width, y + high / 2), radius=high / 2, fill=INK)
        self._pen.text((left + width / 2, y), text, font=font, fill=WHITE, anchor="mm")

    def _text(
        self, at: tuple[float, float], text: str, size: float, colour: Colour, bold: bool = False, anchor: str = "la"
    ) -> None:
        font = ImageFont.load_default(self._px(size))
        stroke = 0.018 * size * self._unit if bold else 0
        self._pen.text(at, text.translate(PLAIN), font=font, fill=colour, anchor=anchor, stroke_width=stroke)

    def _px(self, length: float) -> int:
        return max(1, round(length * self._unit))
