"""What both printed sheets share: paper, pen, words in any language's letters, and the line to check the printer by."""

from __future__ import annotations

from datetime import UTC, datetime

from fpdf import FPDF
from fpdf.enums import Align, WrapMode
from fpdf.prefs import ViewerPreferences

from lubdub.report.line_breaks import broken
from lubdub.report.stationery import PAPERS, PLAIN, WIDE_FILES, Paper, Style, letters_for

Colour = tuple[int, int, int]
EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
"""Written into every file as its time of making, so that the same sheet is the same bytes."""
INK, QUIET, FAINT, TEAL = (22, 40, 44), (92, 101, 104), (170, 176, 176), (0, 98, 103)


class Sheet(FPDF):
    """One page of exact sizes, mm from its top left corner."""

    def __init__(self, paper: Paper, title: str, language: str, sample: str) -> None:
        """sample: all that will be written, to find out which letters are needed. Raises FontMissing."""
        super().__init__(unit="mm", format=PAPERS[paper])
        self.viewer_preferences = ViewerPreferences(print_scaling="None", display_doc_title=True)
        self.set_creation_date(EPOCH)
        self.set_title(title)
        self.set_lang(language)
        self.set_auto_page_break(False)
        self.c_margin = 0.0
        self._face = "Helvetica"
        for style in WIDE_FILES:
            letters = letters_for(sample, style)
            if letters is not None:
                self._face = "Wide"
                self.add_font("Wide", style, letters)
        self.add_page()

    def words(
        self,
        top: float,
        text: str,
        points: float,
        style: Style = "",
        colour: Colour = INK,
        left: float = 18.0,
        width: float = 0.0,
        align: Align = Align.L,
    ) -> float:
        """Words from a height downwards, broken into lines; width 0: to the right edge. Returns where they end."""
        self.set_font(self._face, style, points)
        self.set_text_color(*colour)
        self.set_xy(left, top)
        text = text.translate(PLAIN) if self._face == "Helvetica" else text
        wrap = WrapMode.WORD
        if self._face == "Wide":
            text, wrap = broken(text, width or self.w - self.r_margin - left, self.get_string_width), WrapMode.CHAR
        self.multi_cell(width, points * 0.45, text, align=align, wrapmode=wrap)
        return float(self.get_y())

    def pen(self, colour: Colour, thick: float) -> None:
        """Colour and breadth, mm, of the next lines."""
        self.set_draw_color(*colour)
        self.set_line_width(thick)

    def bar(self, left: float, top: float, length: float) -> None:
        """A line of exactly this length between two ends, with a tick at each centimetre."""
        self.pen(INK, 0.4)
        self.line(left, top, left + length, top)
        for end in (left, left + length):
            self.line(end, top - 3, end, top + 3)
        self.pen(INK, 0.2)
        for step in range(1, int(length) // 10 + (length % 10 > 0)):
            self.line(left + 10 * step, top - 1.5, left + 10 * step, top + 1.5)
