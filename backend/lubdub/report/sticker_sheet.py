"""The printable sheet with the two stickers, as PDF: exact sizes, a line to check the printer by, and what to do.

Drawn with lines and the standard typeface that every PDF reader has, so the file is small and prints the same anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from fpdf.enums import Align

from lubdub.geometry.stickers import BONES, MARK_CELLS, SMALL_UNTIL_YEARS, STICKERS, Bone, Sticker, StickerSize
from lubdub.report.printing import FAINT, INK, QUIET, TEAL, Sheet
from lubdub.report.stationery import Paper

CHECK_MM = 50.0
EDGE = 18.0
MIDDLE_OF_STICKERS = 110.0
Curve = tuple[tuple[float, float], ...]
NOTCH_Y, END_Y = 54.0, 108.0
OUTLINE: tuple[Curve, ...] = (
    ((24, 4), (24, 20), (34, 26), (58, 33)),
    ((58, 33), (78, 40), (88, 58), (87, 90)),
    ((87, 90), (86, 120), (84, 140), (88, 168)),
    ((52, 112), (56, 132), (50, 150), (55, 168)),
)
BONE_LINES: tuple[Curve, ...] = (
    ((8, 50), (20, 42), (36, 44), (56, 38)),
    ((7, 60), (4, 78), (7, 92), (4, 106)),
    ((4, 110), (18, 116), (30, 130), (38, 146)),
)
"""The right half of a chest, x from its middle, 200 wide: skin; then collarbone, breastbone, rim of the ribs."""
NUMBERS: dict[Bone, str] = {"suprasternal_notch": "1", "xiphisternum": "2"}


@dataclass(frozen=True)
class SheetWords:
    """Every sentence of the sheet."""

    title: str
    for_whom: str
    print_heading: str
    print_how: str
    check: str
    cut_heading: str
    cut_how: str
    stick_heading: str
    stick_top: str
    stick_end: str
    scan_heading: str
    scan_how: str
    not_on: str
    names: dict[Bone, str]


def sticker_words(size: StickerSize, _: Callable[[str], str] = str) -> SheetWords:
    """The sheet's words for a reader of ten; English when no other language's gettext is given."""
    years = f"{SMALL_UNTIL_YEARS:g}"
    whom = _("For a baby under {years} year.") if size == "small" else _("For anyone of {years} year or more.")
    return SheetWords(
        title=_("Two stickers for the scan"),
        for_whom=whom.format(years=years),
        print_heading=_("1. Print this page at its true size"),
        print_how=_('Use plain paper. In the print window, choose "Actual size" or "100 %", not "Fit to page".'),
        check=_("Check with a ruler: this line must be exactly 50 mm long. If it is not, print again."),
        cut_heading=_("2. Cut out both circles"),
        cut_how=_("Cut along the thin grey lines. Put a loop of soft skin tape on the back of each one."),
        stick_heading=_("3. Stick them on the bare chest"),
        stick_top=_(
            "Sticker 1: slide a finger down the throat into the soft dip. Feel the hard edge of bone just below it. "
            "The middle of sticker 1 goes on that edge."
        ),
        stick_end=_(
            "Sticker 2: slide a finger down the middle of the chest until the hard bone stops and the soft belly "
            "begins. The middle of sticker 2 goes on the last hard spot."
        ),
        scan_heading=_("4. Scan, then take them off"),
        scan_how=_(
            "Press them flat. Use the back camera of the phone, in good light, and see both stickers. "
            "Use no mirror. Take the stickers off after the scan."
        ),
        not_on=_("Do not put them on sore or broken skin. Do not leave a baby alone with them."),
        names={"suprasternal_notch": _("Top of the breastbone"), "xiphisternum": _("Lower end of the breastbone")},
    )


def sticker_sheet(
    paper: Paper = "a4", size: StickerSize = "large", words: SheetWords | None = None, language: str = "en"
) -> bytes:
    """One page of PDF, the same bytes each time. size: small for babies. words: English when not given.

    Raises FontMissing when the language's letters are not installed.
    """
    words = words or sticker_words(size)
    page = Sheet(paper, words.title, language, " ".join([*map(str, vars(words).values())]))
    page.words(15.0, words.title, 22, "B", TEAL)
    page.words(25.5, words.for_whom, 12)
    _line_to_check(page, words)
    _two_stickers(page, words, size)
    _where_they_go(page, words)
    page.words(236.0, words.scan_heading, 13, "B", TEAL)
    page.words(243.0, words.scan_how, 11)
    return bytes(page.output())


def _line_to_check(page: Sheet, words: SheetWords) -> None:
    page.words(35.0, words.print_heading, 13, "B", TEAL)
    end = page.words(42.0, words.print_how, 11)
    end = page.words(max(49.0, end + 0.5), words.check, 11)
    top = max(63.0, end + 4.5)
    page.bar(EDGE, top, CHECK_MM)
    page.words(top - 2.4, f"{CHECK_MM:g} mm", 11, "B", left=EDGE + CHECK_MM + 4)


def _two_stickers(page: Sheet, words: SheetWords, size: StickerSize) -> None:
    page.words(74.0, words.cut_heading, 13, "B", TEAL)
    page.words(81.0, words.cut_how, 11)
    for sticker in (one for one in STICKERS if one.size == size):
        middle = sticker_middle(page.w, sticker.bone)
        _sticker(page, sticker, *middle)
        label = f"{NUMBERS[sticker.bone]}  {words.names[sticker.bone]}"
        page.words(middle[1] + 23.0, label, 12, "B", left=middle[0] - 40, width=80, align=Align.C)


def sticker_middle(page_width: float, bone: Bone) -> tuple[float, float]:
    """Where a sticker's middle lies on the page, mm from its top left corner."""
    return page_width / 2 + (-45.0 if bone == BONES[0] else 45.0), MIDDLE_OF_STICKERS


def _sticker(page: Sheet, sticker: Sticker, x: float, y: float) -> None:
    radius, half = sticker.diameter_mm / 2, sticker.mark_mm / 2
    page.pen(FAINT, 0.2)
    page.circle(x, y, radius)
    page.set_fill_color(0)
    for row, cells in enumerate(sticker.cells()):
        for first, last in _runs(cells.tolist()):
            left, top = x - half + first * sticker.cell_mm, y - half + row * sticker.cell_mm
            # Rows overlap a hair, or printers leave white lines between them.
            page.rect(left, top, (last - first) * sticker.cell_mm, sticker.cell_mm + 0.02 * (row < MARK_CELLS - 1), "F")
    room = radius - half - sticker.cell_mm
    points = 2.4 * room
    page.words(y + half + sticker.cell_mm - 0.1 * room, NUMBERS[sticker.bone], points, "B", QUIET, x - 5, 10.0, Align.C)


def _runs(cells: list[bool]) -> list[tuple[int, int]]:
    """(first, last + 1) of each unbroken run of black squares."""
    edges = [place for place, (a, b) in enumerate(pairwise([False, *cells, False])) if a != b]
    return list(zip(edges[::2], edges[1::2], strict=True))


def _where_they_go(page: Sheet, words: SheetWords) -> None:
    page.words(144.0, words.stick_heading, 13, "B", TEAL)
    _chest(page, EDGE, 152.0, 72.0)
    left, width = EDGE + 80.0, page.w - 2 * EDGE - 80.0
    end = 0.0
    for top, words_of in ((155.0, words.stick_top), (183.0, words.stick_end), (211.0, words.not_on)):
        end = page.words(max(top, end + 2.5), words_of, 11, left=left, width=width)


def _chest(page: Sheet, left: float, top: float, width: float) -> None:
    """A chest from the front with both stickers on it."""
    scale = width / 200.0

    def at(x: float, y: float) -> tuple[float, float]:
        return left + scale * x, top + scale * y

    for curves, colour, thick in ((OUTLINE, INK, 0.6), (BONE_LINES, FAINT, 0.5)):
        page.pen(colour, thick)
        for curve in curves:
            for side in (1, -1):
                page.bezier([at(100 + side * x, y) for x, y in curve])
    for bone, y in (("suprasternal_notch", NOTCH_Y), ("xiphisternum", END_Y)):
        page.pen(TEAL, 0.7)
        page.set_fill_color(255)
        page.circle(*at(100, y), 12 * scale, style="FD")
        x_text, y_text = at(100, y)
        page.words(y_text - 2.7, NUMBERS[bone], 12, "B", TEAL, x_text - 5, 10.0, Align.C)  # type: ignore[index]
